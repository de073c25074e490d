// Linear radiance to display values: exposure, a shoulder that keeps hue until highlights, sRGB encoding.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "shared/frame.glsl"
#extension GL_EXT_samplerless_texture_functions : require

layout(local_size_x = 8, local_size_y = 8) in;
layout(binding = 30) uniform texture2D radiance;
layout(binding = 40, rgba8) uniform writeonly image2D display;
layout(push_constant) uniform Params {
  float exposure; // Factor of the radiance.
};

// Linear up to 0.76; above it the peak bends towards 1 and takes the colour along towards white (the shape of the
// Khronos PBR Neutral tone mapper).
vec3 compressed(vec3 color) {
  const float START = 0.76;
  float peak = max(color.r, max(color.g, color.b));
  if (peak < START) {
    return color;
  }
  float room = 1.0 - START;
  float new_peak = 1.0 - room * room / (peak + room - START);
  float whiteness = 1.0 - 1.0 / (0.15 * (peak - new_peak) + 1.0);
  return mix(color * (new_peak / peak), vec3(new_peak), whiteness);
}

vec3 srgb_encoded(vec3 linear) {
  vec3 low = 12.92 * linear;
  vec3 high = 1.055 * pow(max(linear, vec3(0.0031308)), vec3(1.0 / 2.4)) - 0.055;
  return mix(high, low, lessThanEqual(linear, vec3(0.0031308)));
}

void main() {
  uvec2 pixel = gl_GlobalInvocationID.xy;
  if (outside_frame(pixel)) {
    return;
  }
  ivec2 at = ivec2(pixel);
  vec3 color = clamp(texelFetch(radiance, at, 0).rgb * exposure, vec3(0.0), vec3(1e6));
  imageStore(display, at, vec4(srgb_encoded(compressed(color)), 1.0));
}
