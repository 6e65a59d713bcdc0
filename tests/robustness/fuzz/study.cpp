/// Any text is a study whose combinations can be counted, or is refused with InputError.

#include "file.hpp"
#include "perikit/core/errors.hpp"
#include "study/study.hpp"
#include "unit/fake_catalogue.hpp"

extern "C" int LLVMFuzzerTestOneInput(const unsigned char* data, std::size_t size) {
  using namespace perikit;
  static test::FakeCatalogue parts;
  static const InputFolder folder;
  static const bool scene = static_cast<bool>(std::ofstream(folder.path / "scene.toml") << "format = 1\n");   // has to be there, and is not read
  if (!scene) __builtin_trap();
  try {
    const Study study = parse_study(std::string(reinterpret_cast<const char*>(data), size), folder.path / "fuzz.toml", parts);
    std::size_t expected = study.zip ? study.keys.front().values.size() : 1;
    for (const StudyKey& key : study.keys) {
      if (key.key.empty() || key.values.empty()) __builtin_trap();
      if (!study.zip) expected *= key.values.size();
    }
    if (expected > 1000000) __builtin_trap();   // all of them are made at once
    const auto all = combinations(study);
    if (all.size() != expected) __builtin_trap();
    for (const auto& combination : all) {
      if (combination.size() != study.keys.size()) __builtin_trap();
      for (std::size_t k = 0; k < combination.size(); ++k)
        if (combination[k] >= study.keys[k].values.size()) __builtin_trap();
    }
  } catch (const InputError&) {
  }
  return 0;
}
