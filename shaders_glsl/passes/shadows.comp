// Which lights each pixel's surface cannot see: one bit a light.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "shared/frame.glsl"
#include "shared/gbuffer.glsl"
#include "shared/lights.glsl"
#include "shared/ray_counts.glsl"
#include "shared/ray_offset.glsl"
#include "shared/scene.glsl"
#include "occlusion.glsl"

layout(local_size_x = 8, local_size_y = 8) in;
layout(binding = 40, r32ui) uniform writeonly uimage2D shadow_mask;

void main() {
  uvec2 pixel = gl_GlobalInvocationID.xy;
  if (!outside_frame(pixel)) {
    Seen seen = seen_at(pixel);
    uint mask = 0u;
    float reach = 0.0;
    if (seen.instance != 0u) {
      reach = triangle_reach(instances[seen.instance - 1u], seen.triangle);
    }
    vec3 origin = offset_origin(seen.position, seen.geometric_normal, reach);
    for (uint index = 0u; index < (seen.instance != 0u ? light_count() : 0u); ++index) {
      Light light = lights[index];
      Arrival arrival = arrival_at(light, seen.position);
      // Behind the surface, out of range and outside of a cone is dark without asking.
      bool dark = dot(arrival.direction, seen.geometric_normal) <= 0.0 || arrival.irradiance == vec3(0.0);
      vec3 towards = arrival.direction;
      float t_max = 1e30;
      if (!DIRECTIONAL_LIGHTS || light.kind != LIGHT_DIRECTIONAL) {
        // Ends before the light by as much as it would start off a surface there: what a lamp lies on does not hide it, and
        // a shade close to a far lamp does.
        towards = offset_origin(light.position, -arrival.direction, reach) - origin;
        t_max = dot(towards, arrival.direction) > 0.0 ? 1.0 : 0.0;
      }
      if (dark || occluded(origin, towards, 0.0, t_max)) {
        mask |= 1u << index;
      }
    }
    imageStore(shadow_mask, ivec2(pixel), uvec4(mask));
  }
  count_rays();
}
