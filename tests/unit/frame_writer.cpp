#include <doctest/doctest.h>
#include <fcntl.h>
#include <hdf5.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <csignal>
#include <fstream>
#include <iterator>
#include <thread>

#include "files/shared_file.hpp"
#include "output/recorder.hpp"
#include "perikit/core/errors.hpp"
#include "tests/kit/messages.hpp"
#include "tests/unit/temporary_folder.hpp"

using namespace perikit;
using namespace perikit::test;
namespace fs = std::filesystem;

namespace {

constexpr std::size_t points = 4;

ReferenceData reference() {
  ReferenceData data;
  data.points = points;
  data.point = [](std::size_t p) -> ReferenceData::Point {
    const auto x = static_cast<double>(p);
    return {{x, 2 * x, 3 * x}, 0.5, p < 2 ? 0 : 1};
  };
  data.sets.insert({"left", {0, 2}});
  data.sets.insert({"nothing", ReferenceData::Set(std::vector<std::int64_t>())});
  return data;
}

const RunAttributes run{"0.1.0", "Körper \"<&>\"", std::string(200'000, 's')};

std::vector<OutputField> fields(double value) {
  return {{"displacement", 3, std::vector<double>(3 * points, value)},
          {"cauchy", 9, std::vector<double>(9 * points, 2 * value)},
          {"damage", 1, std::vector<double>(points, 3 * value)}};
}

/// What HDF5 itself says about a dataset, apart from the classes under test.
struct Dataset {
  std::vector<hsize_t> shape;
  std::vector<double> data;
  bool is_float = false;
};

Dataset dataset(const fs::path& file, const std::string& path) {
  Dataset result;
  const hid_t id = H5Fopen(file.c_str(), H5F_ACC_RDONLY, H5P_DEFAULT);
  REQUIRE(id >= 0);
  const hid_t data = H5Dopen2(id, path.c_str(), H5P_DEFAULT);
  REQUIRE_MESSAGE(data >= 0, path);
  const hid_t space = H5Dget_space(data), type = H5Dget_type(data);
  result.shape.resize(static_cast<std::size_t>(H5Sget_simple_extent_ndims(space)));
  H5Sget_simple_extent_dims(space, result.shape.data(), nullptr);
  result.data.resize(static_cast<std::size_t>(H5Sget_simple_extent_npoints(space)));
  result.is_float = H5Tget_class(type) == H5T_FLOAT && H5Tget_size(type) == 8;
  if (!result.data.empty()) CHECK(H5Dread(data, H5T_NATIVE_DOUBLE, H5S_ALL, H5S_ALL, H5P_DEFAULT, result.data.data()) >= 0);
  H5Tclose(type), H5Sclose(space), H5Dclose(data), H5Fclose(id);
  return result;
}

template <class T>
T number(const fs::path& file, const std::string& group, const char* name, hid_t type) {
  T value{};
  const hid_t id = H5Fopen(file.c_str(), H5F_ACC_RDONLY, H5P_DEFAULT);
  const hid_t attribute = H5Aopen_by_name(id, group.c_str(), name, H5P_DEFAULT, H5P_DEFAULT);
  REQUIRE(attribute >= 0);
  CHECK(H5Aread(attribute, type, &value) >= 0);
  H5Aclose(attribute), H5Fclose(id);
  return value;
}

std::string text(const fs::path& file, const char* name) {
  const hid_t id = H5Fopen(file.c_str(), H5F_ACC_RDONLY, H5P_DEFAULT);
  const hid_t attribute = H5Aopen(id, name, H5P_DEFAULT);
  REQUIRE(attribute >= 0);
  const hid_t type = H5Aget_type(attribute);
  CHECK(H5Tget_cset(type) == H5T_CSET_UTF8);
  char* characters = nullptr;
  CHECK(H5Aread(attribute, type, &characters) >= 0);
  const std::string result = characters;
  H5free_memory(characters), H5Tclose(type), H5Aclose(attribute), H5Fclose(id);
  return result;
}

std::size_t count_files(const fs::path& folder) {
  return static_cast<std::size_t>(std::distance(fs::directory_iterator(folder), fs::directory_iterator{}));
}

}  // namespace

TEST_CASE("a run's files have the documented layout, also after the folder was moved") {
  const TemporaryFolder folder;
  {
    FrameWriter writer(folder.path / "a" / "run", reference(), run);
    for (int k = 0; k < 12; ++k) writer.write(0.25 * k, 10 * k, fields(k));
    CHECK(writer.frames() == 12);
  }
  fs::rename(folder.path / "a" / "run", folder.path / "moved");
  const fs::path results = folder.path / "moved" / "results.h5";
  const Dataset displacement = dataset(results, "/frames/00000003/displacement");
  CHECK(displacement.shape == std::vector<hsize_t>{points, 3});
  CHECK(displacement.is_float);
  CHECK(displacement.data == std::vector<double>(3 * points, 3.0));
  CHECK(dataset(results, "/frames/00000011/cauchy").shape == std::vector<hsize_t>{points, 9});
  CHECK(dataset(results, "/frames/00000011/damage").shape == std::vector<hsize_t>{points});
  CHECK(dataset(folder.path / "moved/frames/00000011.h5", "/damage").data[0] == 33.0);
  CHECK(number<double>(results, "/frames/00000003", "time", H5T_NATIVE_DOUBLE) == 0.75);
  CHECK(number<std::int64_t>(results, "/frames/00000003", "step", H5T_NATIVE_INT64) == 30);

  CHECK(dataset(results, "/reference/position").data == std::vector<double>{0, 0, 0, 1, 2, 3, 2, 4, 6, 3, 6, 9});
  CHECK(dataset(results, "/reference/volume").shape == std::vector<hsize_t>{points});
  CHECK_FALSE(dataset(results, "/reference/id").is_float);
  CHECK(dataset(results, "/reference/material_id").data == std::vector<double>{0, 0, 1, 1});
  CHECK(dataset(results, "/reference/set_left").data == std::vector<double>{0, 2});
  CHECK(dataset(results, "/reference/set_nothing").data.empty());
  for (const char* file : {"results.h5", "reference.h5"}) {
    CHECK(text(folder.path / "moved" / file, "perikit_version") == run.perikit_version);
    CHECK(text(folder.path / "moved" / file, "title") == run.title);
    CHECK(text(folder.path / "moved" / file, "scene") == run.scene);
  }
  CHECK(count_files(folder.path / "moved") == 4);
  CHECK(count_files(folder.path / "moved" / "frames") == 12);
}

TEST_CASE("a frame from pieces is the same file, byte for byte, and a field that lacks rows or has too many is refused") {
  const TemporaryFolder folder;
  FrameWriter writer(folder.path, reference(), run);
  std::vector<OutputField> all = fields(0);
  double number = 0;
  for (OutputField& field : all)
    for (double& value : field.data) value = ++number;
  writer.write(1.5, 7, all);
  writer.begin(1.5, 7);
  for (const OutputField& field : all) {
    const std::span<const double> values(field.data);
    const auto rows = [&](std::size_t first, std::size_t count) { return values.subspan(first * static_cast<std::size_t>(field.width), count * static_cast<std::size_t>(field.width)); };
    writer.add(field.name, field.width, rows(0, 1));
    writer.add(field.name, field.width, rows(1, points - 1));
  }
  writer.end();
  writer.finish();
  CHECK(read_text(folder.path / "frames/00000001.h5") == read_text(folder.path / "frames/00000000.h5"));
  // Rows that others write.
  writer.begin(1.5, 7);
  for (const OutputField& field : all) {
    const std::uint64_t at = writer.reserve(field.name, field.width);
    SharedFile other(writer.file());
    REQUIRE(other.refusal().empty());
    const std::size_t half = points / 2 * static_cast<std::size_t>(field.width);
    other.write(at + half * sizeof(double), std::span(field.data).subspan(half));
    other.write(at, std::span(field.data).first(half));
    CHECK(other.close().empty());
  }
  writer.end();
  writer.finish();
  CHECK(read_text(folder.path / "frames/00000002.h5") == read_text(folder.path / "frames/00000000.h5"));
  CHECK(dataset(folder.path / "results.h5", "/frames/00000001/cauchy").data == all[1].data);

  writer.begin(2, 8);
  writer.add("damage", 1, std::vector<double>(points - 1, 0.0));
  CHECK_THROWS_WITH_AS(writer.end(), doctest::Contains("field 'damage' has 3 values; 4 points of width 1 need 4"), RunError);
  writer.begin(2, 8);
  CHECK_THROWS_WITH_AS(writer.add("damage", 1, std::vector<double>(points + 1, 0.0)), doctest::Contains("field 'damage' has 5 values"), RunError);
  CHECK(writer.frames() == 3);
}

TEST_CASE("the last frame comes back in input order; a wrong body or file is refused by name") {
  const TemporaryFolder folder;
  FrameWriter writer(folder.path, reference(), run);
  const fs::path results = folder.path / "results.h5";
  CHECK_THROWS_WITH_AS(read_last_frame(results, points), doctest::Contains("no frame yet"), InputError);
  writer.write(1.5, 7, fields(1));
  writer.write(2.5, 9, fields(2));
  const LoadedFrame frame = read_last_frame(results, points);
  CHECK(frame.time == 2.5);
  CHECK(frame.step == 9);
  CHECK(frame.fields.size() == 3);
  CHECK(frame.fields.at("cauchy").width == 9);
  CHECK(frame.fields.at("displacement").data == fields(2)[0].data);
  const LastFrame some(results, points);
  CHECK(some.fields().at("cauchy") == 9);
  std::vector<double> rows;
  some.each_row("displacement", std::vector<std::int64_t>{1, 3}, [&](std::size_t k, std::span<const double> row) {
    CHECK(k == rows.size() / 3);
    rows.insert(rows.end(), row.begin(), row.end());
  });
  const std::vector<double>& whole = frame.fields.at("displacement").data;
  CHECK(std::equal(rows.begin(), rows.begin() + 3, whole.begin() + 3));
  CHECK(std::equal(rows.begin() + 3, rows.end(), whole.begin() + 9));
  CHECK(rows.size() == 6);
  CHECK_THROWS_WITH_AS(some.each_row("displacement", std::vector<std::int64_t>{4}, [](std::size_t, std::span<const double>) {}),
                       doctest::Contains("one of number 4 is wanted"), InputError);
  CHECK_THROWS_WITH_AS(read_last_frame(results, 5), doctest::Contains("found 4 points; this body has 5"), InputError);
  CHECK_THROWS_WITH_AS(read_last_frame(folder.path / "none.h5", points), doctest::Contains("No such file"), InputError);
  write_file_atomically(folder.path / "text.h5", "not HDF5");
  CHECK_THROWS_WITH_AS(read_last_frame(folder.path / "text.h5", points), doctest::Contains("text.h5: is not an HDF5 file"),
                       InputError);
  fs::remove(folder.path / "frames/00000001.h5");
  CHECK_THROWS_WITH_AS(read_last_frame(results, points), doctest::Contains("frames/00000001.h5 is missing"), InputError);
}

TEST_CASE("a continued run keeps the frames before it and drops later ones and stale temporaries") {
  const TemporaryFolder folder;
  {
    FrameWriter writer(folder.path, reference(), run);
    for (int k = 0; k < 5; ++k) writer.write(k, k, fields(k));
  }
  std::ofstream(folder.path / "frames/.00000005.h5.4711.part") << "torn";
  {
    FrameWriter writer(folder.path, reference(), run, 3);
    CHECK(writer.frames() == 3);
    CHECK(count_files(folder.path / "frames") == 3);
    CHECK(count_files(folder.path) == 4);
    CHECK(read_last_frame(folder.path, points).time == 2);
    writer.write(2.25, 11, fields(9));
  }
  CHECK(read_last_frame(folder.path, points).step == 11);
  const std::string sidecar = read_text(folder.path / "results.xdmf");
  CHECK(sidecar.find("<Time Value=\"2\"/>") != std::string::npos);
  CHECK(sidecar.find("<Time Value=\"2.25\"/>") != std::string::npos);
  CHECK(sidecar.find("<Time Value=\"3\"/>") == std::string::npos);
  CHECK_THROWS_WITH_AS(FrameWriter(folder.path, reference(), run, 9), doctest::Contains("frames/00000004.h5"), InputError);
  FrameWriter anew(folder.path, reference(), run);
  CHECK(count_files(folder.path / "frames") == 0);
  CHECK_FALSE(fs::exists(folder.path / "results.xdmf"));
}

TEST_CASE("kill -9 at any moment leaves every finished frame readable") {
  const TemporaryFolder folder;
  for (int round = 0; round < 10; ++round) {
    // The child reports each frame that write() has finished, so a frame may be one ahead of the report but never behind.
    int reports[2];
    REQUIRE(::pipe(reports) == 0);
    const pid_t child = ::fork();
    if (child == 0) {
      FrameWriter writer(folder.path, reference(), run);
      for (int k = 0;; ++k) {
        writer.write(k, k, fields(k));
        if (::write(reports[1], "f", 1) != 1) ::_exit(1);
      }
    }
    ::close(reports[1]);
    // Killed after a few frames, at another part of the next one in each round, however slow the disk is.
    char report = 0;
    const int wait_for = 2 + round % 4;
    std::chrono::duration<double> one_frame{};
    for (int k = 0; k < wait_for; ++k) {
      const auto start = std::chrono::steady_clock::now();
      REQUIRE(::read(reports[0], &report, 1) == 1);
      one_frame = std::chrono::steady_clock::now() - start;
    }
    std::this_thread::sleep_for(one_frame * (0.05 + 0.1 * round));
    ::kill(child, SIGKILL);
    ::waitpid(child, nullptr, 0);
    std::int64_t finished = wait_for;
    while (::read(reports[0], &report, 1) == 1) ++finished;
    ::close(reports[0]);

    const LoadedFrame last = read_last_frame(folder.path, points);
    CHECK(last.step >= finished - 1);
    for (std::int64_t k = 0; k <= last.step; ++k) {
      char path[40];
      std::snprintf(path, sizeof path, "/frames/%08d/displacement", static_cast<int>(k));
      CHECK(dataset(folder.path / "results.h5", path).data == fields(static_cast<double>(k))[0].data);
    }
    CHECK(read_text(folder.path / "results.xdmf").ends_with("</Xdmf>\n"));
    // A torn file has a temporary name only: whatever is called a frame is whole.
    for (const fs::directory_entry& entry : fs::directory_iterator(folder.path / "frames")) {
      if (entry.path().extension() == ".h5") CHECK(dataset(entry.path(), "/cauchy").shape[0] == points);
    }
  }
}

TEST_CASE("a full disk is a RunError with file and reason, and earlier frames stay") {
  const TemporaryFolder folder;
  FrameWriter writer(folder.path, reference(), run);
  writer.write(1, 1, fields(1));
  const std::string results_before = read_text(folder.path / "results.h5");

  rlimit before{};
  ::getrlimit(RLIMIT_FSIZE, &before);
  const auto handler = std::signal(SIGXFSZ, SIG_IGN);
  const rlimit small{1000, before.rlim_max};
  ::setrlimit(RLIMIT_FSIZE, &small);
  const std::string message = message_of<RunError>([&] { writer.write(2, 2, fields(2)); });
  ::setrlimit(RLIMIT_FSIZE, &before);
  std::signal(SIGXFSZ, handler);

  CHECK(message.find("frames/00000001.h5: cannot write: File too large") != std::string::npos);
  CHECK(read_text(folder.path / "results.h5") == results_before);
  CHECK(read_last_frame(folder.path, points).step == 1);
  CHECK(count_files(folder.path / "frames") == 1);
  writer.write(2, 2, fields(2));
  CHECK(read_last_frame(folder.path, points).step == 2);
}

TEST_CASE("a frame that could not be stored behind the back of its writer is told of by what comes next, and the one after it takes its place") {
  const TemporaryFolder folder;
  FrameWriter writer(folder.path, reference(), run);
  const auto add = [&](int number) {
    writer.begin(number, number);
    for (const OutputField& field : fields(number)) writer.add(field.name, field.width, field.data);
    writer.end();
  };
  const auto lock = [&](bool on) {   // the folder of frames is not where it was
    fs::rename(folder.path / (on ? "frames" : "away"), folder.path / (on ? "away" : "frames"));
  };
  add(1);
  CHECK(writer.frames() == 1);
  writer.begin(2, 2);
  for (const OutputField& field : fields(2)) writer.add(field.name, field.width, field.data);
  lock(true);
  writer.end();
  CHECK(writer.frames() == 1);
  CHECK_THROWS_WITH_AS(writer.begin(3, 3), doctest::Contains("frames/00000001.h5: cannot write: No such file"), RunError);
  lock(false);
  add(3);
  writer.finish();
  CHECK(writer.frames() == 2);
  CHECK(read_last_frame(folder.path, points).step == 3);
}

TEST_CASE("folders that cannot be used are named with the system's reason") {
  const TemporaryFolder folder;
  write_file_atomically(folder.path / "file", "text");
  CHECK_THROWS_WITH_AS(FrameWriter(folder.path / "file", reference(), run), doctest::Contains("file: cannot create the folder: "),
                       RunError);
  CHECK_THROWS_WITH_AS(FrameWriter(folder.path / "file/run", reference(), run), doctest::Contains("Not a directory"), RunError);
  CHECK_THROWS_WITH_AS(write_file_atomically(folder.path / "no/such/file", ""), doctest::Contains("No such file"), RunError);
  CHECK_THROWS_WITH_AS(write_file_atomically(folder.path, ""), doctest::Contains("directory"), RunError);
  if (::geteuid() == 0) {
    MESSAGE("read-only folder not tested: root may write anywhere");
    return;
  }
  fs::create_directory(folder.path / "locked");
  ::chmod((folder.path / "locked").c_str(), 0555);
  CHECK_THROWS_WITH_AS(FrameWriter(folder.path / "locked", reference(), run), doctest::Contains("Permission denied"), RunError);
}

TEST_CASE("a field of the wrong length is refused before anything is written") {
  const TemporaryFolder folder;
  FrameWriter writer(folder.path, reference(), run);
  const std::vector<OutputField> wrong{{"damage", 1, std::vector<double>(points + 1)}};
  CHECK_THROWS_WITH_AS(writer.write(0, 0, wrong), doctest::Contains("field 'damage' has 5 values"), RunError);
  CHECK(writer.frames() == 0);
  CHECK(count_files(folder.path / "frames") == 0);
}
