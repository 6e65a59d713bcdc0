/// Runs a fuzz target on mutated copies of seed files, the same ones each time: mutate RUNS RANDOM_SEED FILE...
/// Without coverage guidance, but also without clang: the short form for every test run. An input that crashes or takes more than ten
/// seconds of processor time (a busy machine must not look like a slow reader) is left in ./fuzz_failure.

#include <fcntl.h>
#include <sys/time.h>
#include <unistd.h>

#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <iterator>
#include <random>
#include <string>
#include <vector>

extern "C" int LLVMFuzzerTestOneInput(const unsigned char* data, std::size_t size);

namespace {

std::string input;

void keep_input(int signal) {
  const int file = open("fuzz_failure", O_CREAT | O_WRONLY | O_TRUNC, 0644);
  const bool kept = file >= 0 && write(file, input.data(), input.size()) == static_cast<ssize_t>(input.size());
  std::fprintf(stderr, "signal %d; input %s fuzz_failure\n", signal, kept ? "kept in" : "could not be written to");
  _exit(1);
}

/// Pieces that parsers treat specially.
const std::vector<std::string> words{"\"", "'", "[", "]", "[[", "]]", "{", "}", "=", ",", "\n", "#", "nan", "inf", "-inf", "1e999", "-1", "0", "1e-320", "9223372036854775808",
                                     "true", "[]", "{}", "\"\"", "\\u0000", "\xff", std::string(1, '\0'), "(", ")", "^", "/0", "x", "t", "rnd", "?", ":", "all", "free", "inside", "jitter"};

std::string mutate(const std::vector<std::string>& seeds, std::mt19937_64& random) {
  const auto below = [&](std::size_t n) { return static_cast<std::size_t>(random() % std::max<std::size_t>(n, 1)); };
  std::string text = seeds[below(seeds.size())];
  for (std::size_t changes = 1 + below(4); changes > 0; --changes) {
    const std::size_t at = below(text.size() + 1), length = std::min(text.size() - at, below(30));
    switch (below(6)) {
      case 0: text.insert(at, words[below(words.size())]); break;
      case 1: text.erase(at, length); break;
      case 2: text.insert(at, text.substr(at, length)); break;
      case 3: if (at < text.size()) text[at] = static_cast<char>(text[at] ^ (1u << below(7))); break;
      case 4: text.replace(at, length, words[below(words.size())]); break;
      default: {
        const std::string& other = seeds[below(seeds.size())];
        const std::size_t from = below(other.size());
        text.insert(at, other.substr(from, below(80)));
      }
    }
  }
  return text;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 4) return 2;
  for (const int signal : {SIGSEGV, SIGABRT, SIGFPE, SIGILL, SIGTRAP, SIGPROF, SIGBUS}) std::signal(signal, keep_input);
  std::vector<std::string> seeds;
  for (int k = 3; k < argc; ++k) {
    std::ifstream file(argv[k], std::ios::binary);
    seeds.emplace_back(std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>());
  }
  std::mt19937_64 random(std::strtoull(argv[2], nullptr, 10));
  for (long runs = std::strtol(argv[1], nullptr, 10); runs > 0; --runs) {
    input = mutate(seeds, random);
    const itimerval limit{{0, 0}, {10, 0}};
    setitimer(ITIMER_PROF, &limit, nullptr);
    LLVMFuzzerTestOneInput(reinterpret_cast<const unsigned char*>(input.data()), input.size());
  }
  return 0;
}
