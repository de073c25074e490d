// Computes nothing: what is left is reading the numbers and writing the answer.
float count(float n, float p, CountDraw random) {
  return n + p;
}
