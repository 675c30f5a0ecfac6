// The course of Levenberg's and Marquardt's method (Marquardt, An Algorithm for Least-Squares
// Estimation of Nonlinear Parameters, 1963). Whoever fits has the model, the loss and the bounds.
//
// Notation:
//   λ   damping: 0 is Gauss' and Newton's step, a large one a short step downhill
#pragma once

namespace unflex {

struct Damping {
  double first = 1e-3;
  double down = 0.1;  // λ changes so after a step that helps
  double up = 10.0;   // and so after one that does not
  double most = 1e12;
};

struct DampedStep {
  bool helped = false;  // the step was taken
  bool ended = false;   // no further one is worth it
};

// Goes on until a step ends it, none helps or most_steps are taken. linearise(): at the place
// reached, before each step. attempt(λ): tries a step and takes it if it helps; gives a DampedStep.
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
