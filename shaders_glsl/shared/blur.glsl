// A separable blur over at most nine pixels.
#ifndef BLUR_GLSL
#define BLUR_GLSL
#extension GL_EXT_samplerless_texture_functions : require
#include "shared/finite.glsl"

// Beyond the border the image is repeated backwards, its edge included: the only extension that keeps the sum of the
// image exactly for a symmetric kernel.
int mirrored(int at, int size) {
  int folded = at < 0 ? -1 - at : at;
  folded = folded >= size ? 2 * size - 1 - folded : folded;
  return clamp(folded, 0, size - 1);
}

// Channels that are no finite number are black.
vec4 finite_or_black(vec4 x) {
  return mix(vec4(0.0), x, bvec4(is_finite(x.x), is_finite(x.y), is_finite(x.z), is_finite(x.w)));
}

// `weights` are those of the centre and of the taps on each side of it; they add up to 1. What is no finite number counts as
// black, so that one bad pixel does not become a square of them. Domain: `radius` at most the picture's side. The sum of the
// picture is kept within 1e-6.
vec4 blurred(texture2D source, ivec2 at, ivec2 size, ivec2 axis, int radius, float weights[5]) {
  vec4 sum = weights[0] * finite_or_black(texelFetch(source, at, 0));
  for (int offset = 1; offset <= radius; ++offset) {
    ivec2 before = at - offset * axis;
    ivec2 after = at + offset * axis;
    vec4 first = texelFetch(source, ivec2(mirrored(before.x, size.x), mirrored(before.y, size.y)), 0);
    vec4 second = texelFetch(source, ivec2(mirrored(after.x, size.x), mirrored(after.y, size.y)), 0);
    sum += weights[offset] * (finite_or_black(first) + finite_or_black(second));
  }
  return sum;
}

#endif
