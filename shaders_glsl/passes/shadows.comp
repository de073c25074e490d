// Which lights each pixel's surface cannot see: one bit a light.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "shared/frame.glsl"
#include "shared/gbuffer.glsl"
#include "shared/lights.glsl"
#include "shared/ray_counts.glsl"
#include "shared/ray_offset.glsl"
#include "occlusion.glsl"

layout(local_size_x = 8, local_size_y = 8) in;
layout(binding = 40, r32ui) uniform writeonly uimage2D shadow_mask;

void main() {
  uvec2 pixel = gl_GlobalInvocationID.xy;
  if (!outside_frame(pixel)) {
    Seen seen = seen_at(pixel);
    uint mask = 0u;
    vec3 origin = offset_origin(seen.position, seen.geometric_normal, frame.scene_unit);
    for (uint index = 0u; index < (seen.instance != 0u ? frame.light_count : 0u); ++index) {
      Arrival arrival = arrival_at(lights[index], seen.position);
      // Behind the surface is dark without asking.
      bool behind = dot(arrival.direction, seen.geometric_normal) <= 0.0;
      if (behind || occluded(origin, arrival.direction, 0.0, arrival.distance * 0.9999)) {
        mask |= 1u << index;
      }
    }
    imageStore(shadow_mask, ivec2(pixel), uvec4(mask));
  }
  count_rays();
}
