#pragma once

namespace perikit::app {

/// The most memory that this process takes from the beginning on, beyond what it had then.
class PeakMemory {
 public:
  PeakMemory();
  /// What it took so far does not count.
  void forget();
  /// With what one of as many processes as there are ranks takes that has the program, its libraries and nothing else [bytes]; 0 where the system does not tell.
  double bytes() const;

 private:
  double before_;
};

}  // namespace perikit::app
