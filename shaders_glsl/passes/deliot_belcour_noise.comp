// The noise map of Deliot and Belcour 2023: for each cell of a grid of slopes a uniform and a standard normal number, as
// half floats in one word (the uniform in its upper half), with those of its three neighbours in a vector.
//
// The paper's map is a texture of 512 x 512 RGBA32F; this is a buffer of as many bytes, in which bits stay what they are.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "shared/constants.glsl"
#include "shared/deliot_belcour_noise.glsl"
#include "shared/half_float.glsl"
#include "shared/hash.glsl"

layout(local_size_x = 8, local_size_y = 8) in;
layout(std430, binding = 40) writeonly buffer Noise { uvec4 noise[]; };

// The greatest half float below 1: a uniform number that rounds to 1 would never pass a gate.
const float GREATEST_UNIFORM = 0.99951171875;

uint noise_of(uvec2 cell) {
  uvec2 inside = cell & (DELIOT_BELCOUR_NOISE_SIZE - 1u);
  uint key = hash(inside.x, inside.y);
  float uniform_number = min(unit_from(mixed(key + 1u)), GREATEST_UNIFORM);
  // Box and Muller 1958.
  float radius = sqrt(-2.0 * log(unit_from(mixed(key + 2u))));
  float normal_number = radius * cos(2.0 * PI * unit_from(mixed(key + 3u)));
  return packed_halves(vec2(normal_number, uniform_number));
}

void main() {
  uvec2 cell = gl_GlobalInvocationID.xy;
  if (any(greaterThanEqual(cell, uvec2(DELIOT_BELCOUR_NOISE_SIZE)))) {
    return;
  }
  noise[cell.y * DELIOT_BELCOUR_NOISE_SIZE + cell.x] = uvec4(
    noise_of(cell),
    noise_of(cell + uvec2(1u, 0u)),
    noise_of(cell + uvec2(0u, 1u)),
    noise_of(cell + uvec2(1u, 1u))
  );
}
