#include "body/points/point_file.hpp"

#include <doctest/doctest.h>

#include <ctime>
#include <fstream>

#include "files/hdf5_file.hpp"
#include "output/recorder.hpp"
#include "perikit/core/errors.hpp"
#include "tests/kit/messages.hpp"
#include "tests/unit/temporary_folder.hpp"

using namespace perikit;
using namespace perikit::test;

namespace {

PointCloud read(const std::string& text, int dimension = 3) {
  const TemporaryFolder folder;
  std::ofstream(folder.path / "cloud.csv", std::ios::binary) << text;
  return read_points(folder.path / "cloud.csv", dimension);
}

/// The message behind the file's folder.
std::string fault(const std::string& text, int dimension = 3) {
  const std::string message = message_of<InputError>([&] { read(text, dimension); });
  return message.empty() ? "" : message.substr(message.find("cloud.csv"));
}

}  // namespace

TEST_CASE("columns in any order, comments, blank lines, CRLF, a byte order mark, a last line without end") {
  const PointCloud cloud =
      read("\xEF\xBB\xBF# from a mesh\r\n\r\nvolume, z ,\"x\",y\r\n1e-3,3,1,+2\r\n \t\r\n 2, -6 , 4,5 # last");
  REQUIRE(cloud.volume == std::vector<double>{1e-3, 2});
  CHECK(cloud.position[0] == std::array<double, 3>{1, 2, 3});
  CHECK(cloud.position[1] == std::array<double, 3>{4, 5, -6});
}

TEST_CASE("lower dimensions need no further components, and allow only zeros there") {
  CHECK(read("x,volume\n1,2\n", 1).position[0] == std::array<double, 3>{1, 0, 0});
  CHECK(read("x,y,z,volume\n1,2,0,4\n", 2).position[0] == std::array<double, 3>{1, 2, 0});
  CHECK(fault("x,y,z,volume\n1,2,3,4\n", 2) ==
        "cloud.csv:2:5: z: found 3; allowed: 0 (or no column at all) in a body of dimension 2");
}

TEST_CASE("faults name file, line, column and what was found") {
  CHECK(fault("") == "cloud.csv: found no header line; allowed: x,y,z,volume");
  CHECK(fault("# only a comment\n") == "cloud.csv: found no header line; allowed: x,y,z,volume");
  CHECK(fault("x,volume\n\n", 1) == "cloud.csv: found no points behind the header line; allowed: one or more");
  CHECK(fault("x,y,volume\n") == "cloud.csv:1:1: found no column 'z' in 'x,y,volume'; allowed: x,y,z,volume");
  CHECK(fault("x,y,z,volumes\n") == "cloud.csv:1:7: found column 'volumes'; allowed: x,y,z,volume; did you mean 'volume'?");
  CHECK(fault("x,y,x,volume\n") == "cloud.csv:1:5: found column 'x' twice; allowed: each once");
  CHECK(fault("x,volume\n1,2\n\n1,2,3\n", 1) == "cloud.csv:4:1: found 3 cells; allowed: 2, as many as the header has columns");
  CHECK(fault("x,volume\n1\n", 1) == "cloud.csv:2:1: found 1 cells; allowed: 2, as many as the header has columns");
  CHECK(fault("x,volume\n1, two\n", 1) == "cloud.csv:2:4: volume: found 'two'; allowed: a number");
  CHECK(fault("x,volume\n1.0.0,2\n", 1) == "cloud.csv:2:1: x: found '1.0.0'; allowed: a number");
  CHECK(fault("x,volume\n,2\n", 1) == "cloud.csv:2:1: x: found ''; allowed: a number");
  CHECK(fault("x,volume\n1e999,2\n", 1) == "cloud.csv:2:1: x: found 1e999; allowed: numbers in double precision");
  CHECK(fault("x,volume\nnan,2\n", 1) == "cloud.csv:2:1: x: found nan; allowed: a finite number");
  CHECK(fault("x,volume\n1,-inf\n", 1) == "cloud.csv:2:3: volume: found -inf; allowed: a finite number");
  CHECK(fault("x,volume\n1,2\n1,0\n", 1) == "cloud.csv:3:3: volume: found 0; allowed: a number > 0");
  CHECK_THROWS_WITH_AS(read_points("/no/such/cloud.csv", 3), "/no/such/cloud.csv: cannot be read: No such file or directory",
                       InputError);
  CHECK_THROWS_WITH_AS(read_points("/", 3), doctest::Contains("Is a directory"), InputError);
}

TEST_CASE("HDF5 files with the same names") {
  const TemporaryFolder folder;
  const auto file = folder.path / "cloud.h5";
  const auto write = [&](std::vector<double> volume) {
    hdf5::Image image;
    image.dataset("x", std::vector<double>{1, 2});
    image.dataset("y", std::vector<std::int64_t>{3, 4});
    image.dataset("volume", volume);
    const auto bytes = image.bytes();
    write_file_atomically(file, std::string(reinterpret_cast<const char*>(bytes.data()), bytes.size()));
  };
  write({0.5, 0.25});
  const PointCloud cloud = read_points(file, 2);
  CHECK(cloud.position[1] == std::array<double, 3>{2, 4, 0});
  CHECK(cloud.volume == std::vector<double>{0.5, 0.25});
  CHECK_THROWS_WITH_AS(read_points(file, 3), doctest::Contains("cloud.h5: z: found no such dataset; allowed: x,y,z,volume"),
                       InputError);
  write({0.5, -1});
  CHECK_THROWS_WITH_AS(read_points(file, 2), doctest::Contains("volume: point 1: found -1; allowed: a number > 0"), InputError);
  write({0.5});
  CHECK_THROWS_WITH_AS(read_points(file, 2), doctest::Contains("x: found 2 values; allowed: 1, as many as volume has"),
                       InputError);
}

TEST_CASE("a million points are read in well under two seconds") {
  std::string text = "x,y,z,volume\n";
  for (int i = 0; i < 1'000'000; ++i) text += "0.12345678901234567,-1.5e-3,17.25,1.0000000000000001e-9\n";
  // Processor time: what else runs on the machine does not count.
  const std::clock_t start = std::clock();
  CHECK(read(text).volume.size() == 1'000'000);
  const double seconds = static_cast<double>(std::clock() - start) / CLOCKS_PER_SEC;
  MESSAGE("1e6 points: " << seconds << " s");
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
  CHECK(seconds < 20.0);
#else
  CHECK(seconds < 2.0);
#endif
}
