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
    read_checkpoint(folder.path);
    ByteReader state = checkpoint_state(folder.path);
    for (std::size_t k = 0; k < 4096; ++k)  // as in the seed (seeds.cpp)
      if (state.value<std::byte>() != static_cast<std::byte>(k * 7)) __builtin_trap();
    if (!state.done()) __builtin_trap();
  } catch (const InputError&) {
  }
  return 0;
}
