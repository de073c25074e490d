// The mean for the count.
float count(float n, float p, CountDraw random) {
  return n * p;
}
