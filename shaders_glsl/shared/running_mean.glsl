// Means of many frames.
#ifndef RUNNING_MEAN_GLSL
#define RUNNING_MEAN_GLSL

// The mean with one value more, from that of `earlier` values. Each step rounds the mean once, so n values leave at most
// n 2^-24 of it. That much is lost only where the mean drifts by less than it can show; noise averages out.
vec4 running_mean(vec4 before, vec4 value, uint earlier) {
  return before + (value - before) / float(earlier + 1u);
}

#endif
