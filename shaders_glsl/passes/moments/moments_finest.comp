// The finest level of the moments: radiance, averaged over the flakes' cone, and its square.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "shared/moment_levels.glsl"
#extension GL_EXT_samplerless_texture_functions : require

layout(local_size_x = 8, local_size_y = 8) in;
layout(binding = 30) uniform texture2D environment_cone; // As large as the finest level.
layout(std430, binding = 40) writeonly buffer MomentLevels { TexelMoments moments[]; };

void main() {
  uvec2 at = gl_GlobalInvocationID.xy;
  if (all(lessThan(at, level_size(0u)))) {
    vec4 radiance = texelFetch(environment_cone, ivec2(at), 0);
    moments[at.y * MOMENTS_WIDTH + at.x] = TexelMoments(radiance, radiance * radiance);
  }
}
