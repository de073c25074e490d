// Length of the view's shift of Wang and Bowles's grid less 1, normalised as printed; a is the view, and a.w the distance
// that stands for the level.

float value(vec4 a, vec4 b, vec4 c) {
  return length(normalize(fract(a.xyz * a.w))) - 1.0;
}
