// A separable blur over at most nine pixels.
#ifndef BLUR_GLSL
#define BLUR_GLSL
#extension GL_EXT_samplerless_texture_functions : require

// Beyond the border the image is repeated backwards, its edge included: the only extension that keeps the sum of the
// image exactly for a symmetric kernel.
int mirrored(int at, int size) {
  int folded = at < 0 ? -1 - at : at;
  folded = folded >= size ? 2 * size - 1 - folded : folded;
  return clamp(folded, 0, size - 1);
}

// `weights` are those of the centre and of the taps on each side of it; they add up to 1.
vec4 blurred(texture2D source, ivec2 at, ivec2 size, ivec2 axis, int radius, float weights[5]) {
  vec4 sum = weights[0] * texelFetch(source, at, 0);
  for (int offset = 1; offset <= radius; ++offset) {
    ivec2 before = at - offset * axis;
    ivec2 after = at + offset * axis;
    vec4 first = texelFetch(source, ivec2(mirrored(before.x, size.x), mirrored(before.y, size.y)), 0);
    vec4 second = texelFetch(source, ivec2(mirrored(after.x, size.x), mirrored(after.y, size.y)), 0);
    sum += weights[offset] * (first + second);
  }
  return sum;
}

#endif
