// Irradiance of a surface facing each direction under the environment, divided by pi.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "shared/environment.glsl"

layout(local_size_x = 8, local_size_y = 8) in;
layout(binding = 40, rgba32f) uniform writeonly image2D irradiance;
layout(push_constant) uniform Params {
  uint columns; // Directions that are summed, along the horizon,
  uint rows; // and from pole to pole.
  float source_level; // Level of the environment that is read in each.
};

void main() {
  ivec2 size = imageSize(irradiance);
  ivec2 at = ivec2(gl_GlobalInvocationID.xy);
  if (any(greaterThanEqual(at, size))) {
    return;
  }
  vec3 normal = direction_at((vec2(at) + 0.5) / vec2(size));
  vec3 sum = vec3(0.0);
  float total = 0.0;
  uint count = columns * rows;
  for (uint index = 0u; index < count; ++index) {
    vec2 uv = (vec2(index % columns, index / columns) + 0.5) / vec2(columns, rows);
    float weight = sin(uv.y * PI) * max(dot(direction_at(uv), normal), 0.0);
    sum += weight * textureLod(sampler2D(environment, linear_wrap_u), uv, source_level).rgb;
    total += weight;
  }
  // Divided by the weights' own sum, so that a constant environment stays exactly that.
  imageStore(irradiance, at, vec4(sum / total, 1.0));
}
