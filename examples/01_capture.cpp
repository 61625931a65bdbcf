// Reads a problem file and prints how likely its objects stay captured, and arrive: 01_capture PROBLEM.json
//
// examples/01_capture.py does the same in Python, to the last bit.

#include <cstdio>
#include <energymargin/energymargin.hpp>

namespace em = energymargin;

int main(int argc, char** argv) {
  if (argc != 2) return std::fprintf(stderr, "usage: 01_capture PROBLEM.json\n"), 2;
  const em::Problem problem = em::load(argv[1]);

  em::CaptureOptions options;
  options.nodes = 200;
  options.trees = 4;  // independent trees say how sure the score is
  const em::CaptureScore score = em::capture_score(problem, options);

  const em::Interval interval = em::interval(score, "capture");
  std::printf("capture score %.6f, 95 %% interval %.6f to %.6f\n", score.capture.mean, interval.low, interval.high);
  if (score.success) std::printf("success score %.6f\n", score.success->mean);
}
