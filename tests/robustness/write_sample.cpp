// Writes a small run into the folder that is named on the command line, for readers that are not perikit's own.
#include <cstdio>
#include <exception>

#include "output/recorder.hpp"

int main(int count, char** arguments) try {
  if (count != 2) return 2;
  perikit::ReferenceData reference;
  reference.points = 24;
  reference.point = [](std::size_t id) -> perikit::ReferenceData::Point {
    const int p = static_cast<int>(id);
    return {{p % 4 * 1.0, p / 4 % 3 * 1.0, p / 12 * 1.0}, 1.0, p / 12};
  };
  reference.sets.insert({"left", {0, 4, 8}});
  perikit::FrameWriter writer(arguments[1], reference, {"0.1.0", "sample <\"&\"> ü", std::string(100'000, '#')});
  for (int k = 0; k < 3; ++k) {
    std::vector<perikit::OutputField> fields{{"displacement", 3, {}}, {"cauchy", 9, {}}, {"damage", 1, {}}};
    for (perikit::OutputField& field : fields) {
      for (int i = 0; i < 24 * field.width; ++i) field.data.push_back(100 * k + i);
    }
    writer.write(0.5 * k, 10 * k, fields);
  }
} catch (const std::exception& error) {
  std::fprintf(stderr, "%s\n", error.what());
  return 1;
}
