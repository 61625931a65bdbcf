// beside PROBLEM.json: the same scores, between two simulations of single-precision Bullet.

#include <cmath>

double resting_height();
void print_scores(const char* file);

int main(int, char** argv) {
  const double before = resting_height();
  print_scores(argv[1]);
  const bool rests = std::abs(before - 0.5) < 0.01;
  return rests && resting_height() == before ? 0 : 1;
}
