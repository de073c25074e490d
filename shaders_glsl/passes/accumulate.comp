// The running mean of frames whose rays pass through different points of each pixel.
#version 460
#extension GL_GOOGLE_include_directive : require
#include "shared/frame.glsl"
#include "shared/running_mean.glsl"
#extension GL_EXT_samplerless_texture_functions : require

layout(local_size_x = 8, local_size_y = 8) in;
layout(binding = 30) uniform texture2D radiance;
layout(binding = 40, rgba32f) uniform image2D mean;
layout(push_constant) uniform Params {
  uint earlier; // Frames in the mean so far.
};

void main() {
  uvec2 pixel = gl_GlobalInvocationID.xy;
  if (outside_frame(pixel)) {
    return;
  }
  ivec2 at = ivec2(pixel);
  vec4 value = texelFetch(radiance, at, 0);
  if (earlier > 0u) {
    value = running_mean(imageLoad(mean, at), value, earlier);
  }
  imageStore(mean, at, value);
}
