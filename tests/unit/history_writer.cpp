#include <doctest/doctest.h>
#include <sys/resource.h>

#include <cmath>
#include <csignal>
#include <fstream>
#include <iterator>
#include <limits>

#include "output/recorder.hpp"
#include "perikit/core/errors.hpp"
#include "tests/unit/temporary_folder.hpp"

using namespace perikit;

namespace {

std::string read_text(const std::filesystem::path& file) {
  std::ifstream stream(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(stream), {}};
}

const std::vector<std::string> columns{"time", "tip_uy"};

}  // namespace

TEST_CASE("rows are in the file at once and read back to the same bits") {
  const TemporaryFolder folder;
  const auto file = folder.path / "history.csv";
  HistoryWriter writer(file, columns);
  CHECK(read_text(file) == "time,tip_uy\n");
  const double third = 1.0 / 3.0, tiny = 5e-324;
  writer.row(std::vector{third, tiny});
  const std::string text = read_text(file);
  CHECK(text.ends_with('\n'));
  const std::string row = text.substr(text.find('\n') + 1);
  CHECK(std::stod(row.substr(0, row.find(','))) == third);
  CHECK(std::strtod(row.substr(row.find(',') + 1).c_str(), nullptr) == tiny);
}

TEST_CASE("a value that is not finite is an error that names its column, not a row") {
  const TemporaryFolder folder;
  const auto file = folder.path / "history.csv";
  HistoryWriter writer(file, columns);
  writer.row(std::vector{0.0, 1.0});
  CHECK_THROWS_WITH_AS(writer.row(std::vector{0.5, std::nan("")}), doctest::Contains("column 'tip_uy' is nan where time = 0.5"),
                       RunError);
  CHECK_THROWS_AS(writer.row(std::vector{0.5, std::numeric_limits<double>::infinity()}), RunError);
  CHECK_THROWS_AS(writer.row(std::vector{0.5}), RunError);
  CHECK(read_text(file) == "time,tip_uy\n0,1\n");
}

TEST_CASE("a continued file keeps its first rows and forgets later and torn ones") {
  const TemporaryFolder folder;
  const auto file = folder.path / "history.csv";
  std::ofstream(file) << "time,tip_uy\n0,1\n1,2\n2,3\n3,";
  CHECK_THROWS_WITH_AS(HistoryWriter(file, columns, 4), doctest::Contains("found 3 rows; must be at least 4"), InputError);
  CHECK_THROWS_WITH_AS(HistoryWriter(file, {"time", "other"}, 1), doctest::Contains("found the columns time,tip_uy"), InputError);
  {
    HistoryWriter writer(file, columns, 2);
    CHECK(read_text(file) == "time,tip_uy\n0,1\n1,2\n");
    writer.row(std::vector{1.5, -2.0});
  }
  CHECK(read_text(file) == "time,tip_uy\n0,1\n1,2\n1.5,-2\n");
  CHECK_THROWS_WITH_AS(HistoryWriter(folder.path / "none.csv", columns, 0), doctest::Contains("No such file"), RunError);
  HistoryWriter anew(file, columns);
  CHECK(read_text(file) == "time,tip_uy\n");
}

TEST_CASE("names that would break the table are refused") {
  const TemporaryFolder folder;
  CHECK_THROWS_AS(HistoryWriter(folder.path / "h.csv", {"time", "a,b"}), InputError);
  CHECK_THROWS_AS(HistoryWriter(folder.path / "h.csv", {"time", ""}), InputError);
  CHECK_THROWS_WITH_AS(HistoryWriter(folder.path / "h.csv", {"time", "pull", "pull"}), doctest::Contains("appears twice"),
                       InputError);
}

TEST_CASE("a row that does not fit on the disk leaves no torn line") {
  const TemporaryFolder folder;
  const auto file = folder.path / "history.csv";
  HistoryWriter writer(file, columns);
  writer.row(std::vector{0.0, 1.0});
  const std::string before_text = read_text(file);
  rlimit before{};
  ::getrlimit(RLIMIT_FSIZE, &before);
  const auto handler = std::signal(SIGXFSZ, SIG_IGN);
  const rlimit small{before_text.size() + 3, before.rlim_max};
  ::setrlimit(RLIMIT_FSIZE, &small);
  CHECK_THROWS_WITH_AS(writer.row(std::vector{1.0 / 3.0, 1.0}), doctest::Contains("history.csv: cannot write: File too large"),
                       RunError);
  ::setrlimit(RLIMIT_FSIZE, &before);
  std::signal(SIGXFSZ, handler);
  CHECK(read_text(file) == before_text);
  writer.row(std::vector{2.0, 3.0});
  CHECK(read_text(file) == before_text + "2,3\n");
}
