// The same with the sqrt 2 restored.
#include "shared/blended_count.glsl"

float count(float n, float p, CountDraw random) {
  int steps_left = MOST_BLENDED_COUNT;
  return blended_count(n, p, random.word, true, steps_left);
}
