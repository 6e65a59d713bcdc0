#pragma once
/// The work of driven terms (DrivenTerm) in the account of energies. Over a step their forces f do the work of the trapezoidal rule, as loads do; what
/// their energy e grows by beyond what that takes from the body,
///
///     e_1 - e_0 + (f_0 + f_1) . (u_1 - u_0) / 2,
///
/// has come in from outside, or is minus what was lost. The beginning of the step is kept in the state, so that a run goes on from a snapshot to the bit.

#include "terms/terms.hpp"

namespace perikit {

class State;

class DrivenWork {
 public:
  /// Both must outlive it.
  DrivenWork(Terms& terms, State& state);
  /// A step begins here.
  void begin(const Configuration& at) { find(at, false); }
  /// A step ends here, and the next one begins.
  void end(const Configuration& at) { find(at, true); }

 private:
  void find(const Configuration& at, bool count);

  Terms& terms_;
  State& state_;
};

}  // namespace perikit
