// As Zirr and Kaplanyan 2016 have it: blended inversion, and a normal number that lacks sqrt 2.
#include "shared/blended_count.glsl"

float count(float n, float p, CountDraw random) {
  int steps_left = MOST_BLENDED_COUNT;
  return blended_count(n, p, random.word, false, steps_left);
}
