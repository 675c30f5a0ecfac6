// The course of Levenberg's and Marquardt's method (Marquardt, An Algorithm for Least-Squares
// Estimation of Nonlinear Parameters, 1963). Whoever fits has the model, the loss and the bounds.
//
// Notation:
//   λ   damping: 0 is Gauss' and Newton's step, a large one a short step downhill
#pragma once

namespace unflex {

struct Damping {
  double first = 1e-3;
  double down = 0.1;  // factor of λ after a step that helps
  double up = 10.0;   // factor of λ after a step that does not help
  double most = 1e12;
};

struct DampedStep {
  bool helped = false;  // the step was taken
  bool ended = false;   // no further one is worth it
};

// Makes up to most_steps steps. It ends earlier if a step has `ended` set, or if no λ below `most`
// gives a step that helps. linearise() is called before each step, at the place reached. attempt(λ)
// tries a step, takes it if it helps, and returns a DampedStep.
template <typename Linearise, typename Attempt>
void descend(const Damping& damping, int most_steps, Linearise&& linearise, Attempt&& attempt) {
  double lambda = damping.first;
  for (int step = 0; step < most_steps; ++step) {
    linearise();
    DampedStep tried;
    while (lambda < damping.most && !tried.helped && !tried.ended) {
      tried = attempt(lambda);
      lambda *= tried.helped ? damping.down : damping.up;
    }
    if (tried.ended || !tried.helped) {
      return;
    }
  }
}

}  // namespace unflex
