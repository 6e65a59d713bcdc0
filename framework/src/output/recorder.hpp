#pragma once
/// Result files (layout: README, "Results"): results.h5, reference.h5, frames/<8 digits>.h5, results.xdmf, history.csv.
/// Every file appears by write to a temporary name, fsync and rename, so that a killed run leaves every finished frame readable.

#include <array>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <initializer_list>
#include <map>
#include <memory>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "output_fields/point_field.hpp"

namespace perikit {

/// The body before the run, asked for point by point: a large one is never there twice.
struct ReferenceData {
  struct Point {
    std::array<double, 3> position;   ///< [m]
    double volume = 0;                ///< [m^3]
    std::int64_t material_id = 0;
  };
  /// Ids of points, ascending, a piece at a time.
  class Set {
   public:
    using Use = std::function<void(std::span<const std::int64_t>)>;
    Set(std::initializer_list<std::int64_t> ids) : Set(std::vector<std::int64_t>(ids)) {}
    explicit Set(std::vector<std::int64_t> ids)
        : size_(ids.size()), pieces_([ids = std::move(ids)](const Use& use) { use(ids); }) {}
    Set(std::size_t size, std::function<void(const Use&)> pieces) : size_(size), pieces_(std::move(pieces)) {}
    std::size_t size() const noexcept { return size_; }
    void each(const Use& use) const { pieces_(use); }

   private:
    std::size_t size_;
    std::function<void(const Use&)> pieces_;
  };
  std::size_t points = 0;
  std::function<Point(std::size_t)> point;   ///< by id, 0 to points - 1
  std::map<std::string, Set> sets;
};

struct RunAttributes {
  std::string perikit_version, title, scene;
};

/// Writes the frames of one run into one folder. Throws RunError naming the file and the system's reason (disk full, no permission);
/// nothing written earlier is lost.
class FrameWriter {
 public:
  /// Creates folder and frames/, writes reference.h5 and an empty results.h5. `first_frame` > 0 continues an earlier run: frames
  /// before it stay listed, later ones are removed.
  FrameWriter(std::filesystem::path folder, const ReferenceData&, RunAttributes, std::int64_t first_frame = 0);
  ~FrameWriter();
  /// Writes frames/<next index>.h5, then results.h5, then results.xdmf.
  void write(double time, std::int64_t step, std::span<const OutputField> fields);
  // The same file from pieces, so that nobody needs all of a frame at once, and without waiting for the disk.
  void begin(double time, std::int64_t step);
  /// The next rows of a field; those of one field follow each other. unit: of fields that are not in the table, an attribute of the dataset.
  void add(const std::string& name, int width, std::span<const double> values, const std::string& unit = {});
  /// In place of `add`: room for all rows of a field, which somebody else writes into file() before the frame ends, as numbers of
  /// 64 bits from the byte that is returned on.
  std::uint64_t reserve(const std::string& name, int width, const std::string& unit = {});
  /// The file of the frame that was begun; it has another name when it is complete.
  const std::filesystem::path& file() const;
  /// The frame goes to the disk on a thread of its own, which nothing else of HDF5 may run beside: finish() first. What fails there is
  /// thrown by the next begin() or finish().
  void end();
  /// Waits until the frame that ended is on the disk.
  void finish();
  /// On the disk; waits for the one that is on its way.
  std::int64_t frames() const noexcept;

 private:
  struct Implementation;
  std::unique_ptr<Implementation> implementation_;
};

/// history.csv: a header line with names, then one row per sample; flushed row by row, 17 significant digits.
class HistoryWriter {
 public:
  /// `keep_rows` >= 0 continues an existing file after its first `keep_rows` rows. `missing`: the columns that may be NaN or infinite, written as nan and inf.
  HistoryWriter(const std::filesystem::path& file, std::vector<std::string> columns, std::int64_t keep_rows = -1,
                const std::vector<std::string>& missing = {});
  ~HistoryWriter();
  /// One value per column. Throws RunError naming the column where a value is not finite and may not be missing (the row is not written), or where the disk
  /// is full (the file then ends with the row before).
  void row(std::span<const double> values);
  /// The rows so far survive a machine that stops. Throws RunError.
  void sync();
  std::int64_t rows() const noexcept;

 private:
  struct Implementation;
  std::unique_ptr<Implementation> implementation_;
};

/// Writes text to `file` by temporary name, fsync and rename. Throws RunError.
void write_file_atomically(const std::filesystem::path& file, const std::string& text);

/// Last frame of an earlier run (`results_h5` may also name its folder): point fields in input order. Throws InputError when it cannot be read or the number of points differs.
struct LoadedFrame {
  double time = 0;
  std::int64_t step = 0;
  std::map<std::string, OutputField> fields;
};
LoadedFrame read_last_frame(const std::filesystem::path& results_h5, std::size_t points);

/// The same frame, of which a reader takes what it needs.
class LastFrame {
 public:
  /// Throws InputError as read_last_frame does.
  LastFrame(const std::filesystem::path& results_h5, std::size_t points);
  ~LastFrame();
  double time() const noexcept;
  std::int64_t step() const noexcept;
  /// Names and widths.
  const std::map<std::string, int>& fields() const noexcept;
  /// use(k, row of the point numbers[k]), for ascending numbers; a piece of the field is in memory at a time.
  void each_row(const std::string& field, std::span<const std::int64_t> numbers,
                const std::function<void(std::size_t k, std::span<const double> row)>& use) const;

 private:
  struct Implementation;
  std::unique_ptr<Implementation> implementation_;
};

}  // namespace perikit
