/// Any bytes are the checkpoint that was written, or are refused with InputError: a state is never another one.

#include "file.hpp"
#include "perikit/core/errors.hpp"
#include "run/checkpoint.hpp"

extern "C" int LLVMFuzzerTestOneInput(const unsigned char* data, std::size_t size) {
  using namespace perikit;
  static const InputFolder folder;
  std::ofstream(checkpoint_file(folder.path), std::ios::binary | std::ios::trunc)
      .write(reinterpret_cast<const char*>(data), static_cast<std::streamsize>(size));
  try {
    const Checkpoint checkpoint = read_checkpoint(folder.path);
    if (checkpoint.state.size() != 4096) __builtin_trap();   // as in the seed (seeds.cpp)
    for (std::size_t k = 0; k < checkpoint.state.size(); ++k)
      if (checkpoint.state[k] != static_cast<std::byte>(k * 7)) __builtin_trap();
  } catch (const InputError&) {
  }
  return 0;
}
