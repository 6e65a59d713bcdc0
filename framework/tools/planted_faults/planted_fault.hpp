#pragma once
/// Which of the planted faults is at work, in a copy of the sources that holds all of them: the number in PERIKIT_FAULT, none by default.
/// With PERIKIT_FAULTS_REACHED = FILE (4096 bytes) every place that a fault was planted at leaves a 1 in its byte, from any process.

#include <fcntl.h>
#include <sys/mman.h>
#include <unistd.h>

#include <cstdlib>

namespace planted {

inline const int active = [] {
  const char* number = std::getenv("PERIKIT_FAULT");
  return number ? std::atoi(number) : 0;
}();

inline unsigned char* const reached = [] {
  const char* file = std::getenv("PERIKIT_FAULTS_REACHED");
  const int descriptor = file ? ::open(file, O_RDWR) : -1;
  if (descriptor < 0) return static_cast<unsigned char*>(nullptr);
  void* bytes = ::mmap(nullptr, 4096, PROT_READ | PROT_WRITE, MAP_SHARED, descriptor, 0);
  ::close(descriptor);
  return bytes == MAP_FAILED ? nullptr : static_cast<unsigned char*>(bytes);
}();

/// Whether fault `number` is to take the place of what is right.
inline bool fault(int number) {
  if (reached) [[unlikely]] reached[number] = 1;
  return active == number;
}

}  // namespace planted
