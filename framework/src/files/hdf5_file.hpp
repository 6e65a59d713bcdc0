#pragma once
/// The little of HDF5 that perikit needs: files that are made, files that are read.

#include <hdf5.h>

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <span>
#include <string>
#include <vector>

#include "files/atomic_file.hpp"
#include "files/hdf5_driver.hpp"

namespace perikit::hdf5 {

/// An HDF5 identifier that closes itself.
class Handle {
 public:
  using Close = herr_t (*)(hid_t);
  Handle() noexcept = default;
  Handle(hid_t id, Close close) noexcept : id_(id), close_(close) {}
  Handle(Handle&& other) noexcept;
  Handle& operator=(Handle&& other) noexcept;
  ~Handle();
  hid_t get() const noexcept { return id_; }
  explicit operator bool() const noexcept { return id_ >= 0; }

 private:
  hid_t id_ = H5I_INVALID_HID;
  Close close_ = nullptr;
};

/// A file that is being made. Methods throw RunError (out of memory, or a name that is already there).
class NewFile {
 public:
  /// `values` as a dataset of shape (n) for width 1, else (n, width).
  void dataset(const std::string& path, std::span<const double> values, int width = 1);
  void dataset(const std::string& path, std::span<const std::int64_t> values);
  void dataset(const std::string& path, std::span<const std::byte> values);
  /// A dataset of shape (rows) for width 1, else (rows, width), whose rows come later, in order.
  class Rows {
   public:
    void append(std::span<const double> values);
    void append(std::span<const std::int64_t> values);
    void append(std::span<const std::byte> values);

   private:
    friend class NewFile;
    void append(const void* values, std::size_t size, hid_t memory_type);
    Rows(Handle dataset, std::string path, int width) : dataset_(std::move(dataset)), path_(std::move(path)), width_(width) {}
    Handle dataset_;
    std::string path_;
    int width_;
    std::size_t rows_ = 0;
  };
  enum class Numbers { real, whole, bytes };
  Rows rows(const std::string& path, std::size_t rows, int width = 1, Numbers numbers = Numbers::real);
  /// The same of 64-bit numbers, low byte first, which somebody else writes: they begin at this byte of the file.
  std::uint64_t reserve(const std::string& path, std::size_t rows, int width);
  void group(const std::string& path);
  /// Attributes of the root group; text is stored as UTF-8 of variable length, which has no 64 kB limit.
  void attribute(const std::string& name, double value);
  void attribute(const std::string& name, std::int64_t value);
  void attribute(const std::string& name, const std::string& text);
  /// The same of a dataset.
  void attribute_of(const std::string& path, const std::string& name, const std::string& text);
  /// `path` in this file shows the root group of `file` (relative to the folder that this file lies in).
  void external_link(const std::string& path, const std::string& file);
  bool contains(const std::string& path) const;

 protected:
  /// Not yet a file: `access_` is to say where it is written.
  NewFile();
  ~NewFile() = default;
  void create();

  Handle access_, file_;
};

/// A small one, in memory until `bytes` is stored by the caller.
class Image : public NewFile {
 public:
  Image();
  /// The whole file; valid until the next change.
  std::span<const std::byte> bytes();
};

/// A large one, which is written as it is made and is there at once when it is done. Errors of the disk are RunError with the system's
/// reason, from `check` and `keep`.
class StoredFile : public NewFile {
 public:
  explicit StoredFile(const std::filesystem::path& file);
  ~StoredFile() { file_ = Handle(); }  // before what it is written to
  void check() const { stored_.check(target_.error); }
  /// Its name until it is kept.
  const std::filesystem::path& temporary() const noexcept { return stored_.temporary(); }
  /// All Rows must be gone, and nothing comes after it. last(descriptor, bytes of the file): what is done to it before it gets
  /// its name, returns the system's error code.
  void keep(const std::function<int(int descriptor, std::uint64_t size)>& last = {});

 private:
  AtomicFile stored_;
  Target target_;
};

/// A file on disk, read only. Errors are InputError and name the file.
class Source {
 public:
  struct Array {
    std::vector<std::size_t> shape;
    std::vector<double> data;
    std::size_t rows() const noexcept { return shape.empty() ? 1 : shape[0]; }
    int width() const noexcept { return shape.size() > 1 ? static_cast<int>(shape[1]) : 1; }
  };

  explicit Source(const std::filesystem::path& file);
  /// Names in a group, sorted. Datasets only, or every link (also those whose file is missing).
  std::vector<std::string> names(const std::string& group, bool datasets_only = false) const;
  bool contains(const std::string& path) const;
  /// Any numeric dataset of one or two dimensions, converted to double.
  Array read(const std::string& path) const;
  /// use(k, row numbers[k] of it), for ascending numbers; a piece of it is in memory at a time.
  void each_row(const std::string& path, std::span<const std::int64_t> numbers,
                const std::function<void(std::size_t k, std::span<const double> row)>& use) const;
  /// How many values there are in it, and those first ... last - 1 of them, row by row.
  std::size_t values(const std::string& path) const;
  std::vector<double> read(const std::string& path, std::size_t first, std::size_t last) const;
  /// A flat dataset that was written from bytes; some of it.
  std::vector<std::byte> read_bytes(const std::string& path) const;
  std::vector<std::byte> read_bytes(const std::string& path, std::uint64_t first, std::size_t count) const;
  std::vector<std::size_t> shape(const std::string& path) const;
  double real(const std::string& group, const std::string& attribute) const;
  std::int64_t integer(const std::string& group, const std::string& attribute) const;
  /// Of a group or of a dataset.
  std::string text(const std::string& group, const std::string& attribute) const;
  bool has_attribute(const std::string& path, const std::string& attribute) const;

 private:
  [[noreturn]] void refuse(const std::string& what, const std::string& message) const;
  Handle dataset(const std::string& path) const;
  /// So many rows from `first` on.
  void read_rows(const std::string& path, std::size_t first, std::size_t rows, double* values) const;
  Handle attribute(const std::string& group, const std::string& name) const;

  std::filesystem::path path_;
  Handle file_;
};

}  // namespace perikit::hdf5
