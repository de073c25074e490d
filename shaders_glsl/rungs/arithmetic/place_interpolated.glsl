// Where in its square of texture a point of a triangle lies: the fraction of what is interpolated between the corners a.xyz
// by the weights b.xy of the last two.

float value(vec4 a, vec4 b, vec4 c) {
  return fract(a.x + b.x * (a.y - a.x) + b.y * (a.z - a.x));
}
