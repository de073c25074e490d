// Whether the mirror direction of each glinting pixel is free: one ray, as in Wang, Deng and Holzschuch 2020, section 5.3.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "shared/frame.glsl"
#include "shared/gbuffer.glsl"
#include "shared/materials.glsl"
#include "shared/ray_counts.glsl"
#include "shared/ray_offset.glsl"
#include "shared/scene.glsl"
#include "shared/tile_lists.glsl"
#include "occlusion.glsl"

layout(local_size_x = 8, local_size_y = 8) in;
layout(binding = 40, r32f) uniform writeonly image2D visibility; // 1 free, 0 occluded; 1 where nothing glints.
layout(push_constant) uniform Params {
  uint list; // Of the tiles that show the layer.
};

void main() {
  uvec2 pixel;
  if (listed_pixel(list, pixel)) {
    Seen seen = seen_at(pixel);
    bool asks = seen.instance != 0u;
    asks = asks && (materials[instances[seen.instance - 1u].material].flags & MATERIAL_GLINTS) != 0u;
    float free = 1.0;
    if (asks) {
      vec3 mirrored = reflect(normalize(camera_ray(pixel)), seen.normal);
      // Interpolated or mapped normals may mirror into the surface itself: then along it, or it would hide its own rim.
      mirrored += max(1e-3 - dot(mirrored, seen.geometric_normal), 0.0) * seen.geometric_normal;
      float reach = triangle_reach(instances[seen.instance - 1u], seen.triangle);
      vec3 origin = offset_origin(seen.position, seen.geometric_normal, reach);
      free = occluded(origin, mirrored, 0.0, 1e30) ? 0.0 : 1.0;
    }
    imageStore(visibility, ivec2(pixel), vec4(free));
  }
  count_rays();
}
