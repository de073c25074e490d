// Blurs along one axis with what is beyond the border taken for something else than the mirrored picture: black, the
// edge, or left out.
#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_samplerless_texture_functions : require
#include "shared/blur_edges.glsl"

layout(local_size_x = 8, local_size_y = 8) in;
layout(binding = 30) uniform texture2D source;
layout(binding = 40, rgba32f) uniform writeonly image2D blurred_image;
layout(push_constant) uniform Params {
  ivec2 axis; // (1, 0) or (0, 1).
  int radius; // Taps on each side of the centre.
  uint beyond; // EDGE_*.
  float weights[5]; // Of the centre and of the taps on each side.
};

void main() {
  ivec2 at = ivec2(gl_GlobalInvocationID.xy);
  ivec2 size = textureSize(source, 0);
  if (any(greaterThanEqual(at, size))) {
    return;
  }
  vec4 sum = vec4(0.0);
  float total = 0.0;
  for (int offset = -radius; offset <= radius; ++offset) {
    ivec2 tap = at + offset * axis;
    ivec2 inside = clamp(tap, ivec2(0), size - 1);
    float weight = tap == inside || beyond == EDGE_REPEATED ? weights[abs(offset)] : 0.0;
    sum += weight * texelFetch(source, inside, 0);
    total += weight;
  }
  imageStore(blurred_image, at, beyond == EDGE_LEFT_OUT ? sum / total : sum);
}
