#include "files/hdf5_file.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <system_error>
#include <utility>

#include "perikit/core/errors.hpp"

namespace perikit::hdf5 {

namespace {

constexpr const char* new_file = "a file";

/// HDF5 prints its error stack by itself unless told not to; ours are thrown.
void silence() {
  H5Eset_auto2(H5E_DEFAULT, nullptr, nullptr);
}

Handle checked(hid_t id, Handle::Close close, const std::string& what) {
  if (id < 0) throw RunError(fmt::format("HDF5 cannot create {}", what));
  return {id, close};
}

void check(herr_t status, const std::string& what) {
  if (status < 0) throw RunError(fmt::format("HDF5 cannot write {}", what));
}

Handle utf8_type(const std::string& what) {
  Handle type = checked(H5Tcopy(H5T_C_S1), H5Tclose, what);
  check(H5Tset_size(type.get(), H5T_VARIABLE), what);
  check(H5Tset_cset(type.get(), H5T_CSET_UTF8), what);
  return type;
}

/// Properties of a new object that holds no times: equal contents are equal bytes.
Handle timeless(hid_t kind, const std::string& what) {
  Handle properties = checked(H5Pcreate(kind), H5Pclose, what);
  check(H5Pset_obj_track_times(properties.get(), false), what);
  return properties;
}

Handle make_space(const std::string& path, const std::vector<hsize_t>& shape) {
  return checked(H5Screate_simple(static_cast<int>(shape.size()), shape.data(), nullptr), H5Sclose, path);
}

Handle make_dataset(hid_t file, const std::string& path, hid_t file_type, const std::vector<hsize_t>& shape) {
  const Handle space = make_space(path, shape);
  const Handle properties = timeless(H5P_DATASET_CREATE, path);
  return checked(H5Dcreate2(file, path.c_str(), file_type, space.get(), H5P_DEFAULT, properties.get(), H5P_DEFAULT), H5Dclose, path);
}

std::vector<hsize_t> shape_of(std::size_t rows, int width) {
  std::vector<hsize_t> shape{rows};
  if (width > 1) shape.push_back(static_cast<hsize_t>(width));
  return shape;
}

void write_attribute(hid_t file, const std::string& name, hid_t file_type, hid_t memory_type, const void* data) {
  const Handle space = checked(H5Screate(H5S_SCALAR), H5Sclose, name);
  const Handle attribute =
      checked(H5Acreate2(file, name.c_str(), file_type, space.get(), H5P_DEFAULT, H5P_DEFAULT), H5Aclose, name);
  check(H5Awrite(attribute.get(), memory_type, data), name);
}

}  // namespace

Handle::Handle(Handle&& other) noexcept : id_(std::exchange(other.id_, H5I_INVALID_HID)), close_(other.close_) {}

Handle& Handle::operator=(Handle&& other) noexcept {
  std::swap(id_, other.id_);
  std::swap(close_, other.close_);
  return *this;
}

Handle::~Handle() {
  if (id_ >= 0) close_(id_);
}

NewFile::NewFile() {
  silence();
  access_ = checked(H5Pcreate(H5P_FILE_ACCESS), H5Pclose, new_file);
  // Format 1.8: large groups and large attributes are stored well, and every reader of today opens it.
  check(H5Pset_libver_bounds(access_.get(), H5F_LIBVER_V18, H5F_LIBVER_V18), new_file);
}

void NewFile::create() {
  // HDF5 takes two open files of equal name for the same one.
  static std::atomic<unsigned long> count = 0;
  const std::string name = fmt::format("perikit file {}", count++);
  const Handle properties = timeless(H5P_FILE_CREATE, new_file);
  file_ = checked(H5Fcreate(name.c_str(), H5F_ACC_TRUNC, properties.get(), access_.get()), H5Fclose, new_file);
}

void NewFile::dataset(const std::string& path, std::span<const double> values, int width) {
  rows(path, values.size() / static_cast<std::size_t>(width), width).append(values);
}

NewFile::Rows NewFile::rows(const std::string& path, std::size_t rows, int width, Numbers numbers) {
  const hid_t type = numbers == Numbers::real ? H5T_IEEE_F64LE : numbers == Numbers::whole ? H5T_STD_I64LE : H5T_STD_U8LE;
  return {make_dataset(file_.get(), path, type, shape_of(rows, width)), path, width};
}

std::uint64_t NewFile::reserve(const std::string& path, std::size_t rows, int width) {
  Rows all = this->rows(path, rows, width);
  // HDF5 finds room for all when a row is written, and has written it when the dataset is closed.
  all.append(std::vector<double>(static_cast<std::size_t>(width)));
  const haddr_t place = H5Dget_offset(all.dataset_.get());
  if (place == HADDR_UNDEF) throw RunError(fmt::format("HDF5 finds no room for {}", path));
  return place;
}

void NewFile::Rows::append(std::span<const double> values) { append(values.data(), values.size(), H5T_NATIVE_DOUBLE); }
void NewFile::Rows::append(std::span<const std::int64_t> values) { append(values.data(), values.size(), H5T_NATIVE_INT64); }
void NewFile::Rows::append(std::span<const std::byte> values) {
  append(values.data(), values.size(), H5T_NATIVE_UINT8);
}

void NewFile::Rows::append(const void* values, std::size_t size, hid_t memory_type) {
  const std::size_t count = size / static_cast<std::size_t>(width_);
  if (count == 0) return;
  const std::vector<hsize_t> begin{rows_, 0}, shape = shape_of(count, width_);
  const Handle memory = make_space(path_, shape);
  const Handle file = checked(H5Dget_space(dataset_.get()), H5Sclose, path_);
  check(H5Sselect_hyperslab(file.get(), H5S_SELECT_SET, begin.data(), nullptr, shape.data(), nullptr), path_);
  check(H5Dwrite(dataset_.get(), memory_type, memory.get(), file.get(), H5P_DEFAULT, values), path_);
  rows_ += count;
}

void NewFile::dataset(const std::string& path, std::span<const std::int64_t> values) {
  rows(path, values.size(), 1, Numbers::whole).append(values);
}

void NewFile::dataset(const std::string& path, std::span<const std::byte> values) {
  const Handle dataset = make_dataset(file_.get(), path, H5T_STD_U8LE, {values.size()});
  check(H5Dwrite(dataset.get(), H5T_NATIVE_UINT8, H5S_ALL, H5S_ALL, H5P_DEFAULT, values.data()), path);
}

void NewFile::group(const std::string& path) {
  const Handle properties = timeless(H5P_GROUP_CREATE, path);
  checked(H5Gcreate2(file_.get(), path.c_str(), H5P_DEFAULT, properties.get(), H5P_DEFAULT), H5Gclose, path);
}

void NewFile::attribute(const std::string& name, double value) {
  write_attribute(file_.get(), name, H5T_IEEE_F64LE, H5T_NATIVE_DOUBLE, &value);
}

void NewFile::attribute(const std::string& name, std::int64_t value) {
  write_attribute(file_.get(), name, H5T_STD_I64LE, H5T_NATIVE_INT64, &value);
}

void NewFile::attribute(const std::string& name, const std::string& text) {
  const Handle type = utf8_type(name);
  const char* characters = text.c_str();
  write_attribute(file_.get(), name, type.get(), type.get(), &characters);
}

void NewFile::attribute_of(const std::string& path, const std::string& name, const std::string& text) {
  const Handle dataset = checked(H5Dopen2(file_.get(), path.c_str(), H5P_DEFAULT), H5Dclose, path), type = utf8_type(name);
  const char* characters = text.c_str();
  write_attribute(dataset.get(), name, type.get(), type.get(), &characters);
}

void NewFile::external_link(const std::string& path, const std::string& file) {
  check(H5Lcreate_external(file.c_str(), "/", file_.get(), path.c_str(), H5P_DEFAULT, H5P_DEFAULT), path);
}

bool NewFile::contains(const std::string& path) const {
  return H5Lexists(file_.get(), path.c_str(), H5P_DEFAULT) > 0;
}

Image::Image() {
  constexpr std::size_t growth = 1 << 16;
  check(H5Pset_fapl_core(access_.get(), growth, false), new_file);
  create();
}

std::span<const std::byte> Image::bytes() {
  check(H5Fflush(file_.get(), H5F_SCOPE_LOCAL), new_file);
  void* handle = nullptr;
  check(H5Fget_vfd_handle(file_.get(), access_.get(), &handle), new_file);
  const ssize_t size = H5Fget_file_image(file_.get(), nullptr, 0);
  if (size < 0) throw RunError("HDF5 cannot tell the size of a file in memory");
  return {*static_cast<const std::byte* const*>(handle), static_cast<std::size_t>(size)};
}

StoredFile::StoredFile(const std::filesystem::path& file) : stored_(file), target_{stored_.descriptor()} {
  if (!write_to(target_, access_.get())) throw RunError("HDF5 cannot create " + std::string(new_file));
  create();
}

void StoredFile::keep(const std::function<int(int, std::uint64_t)>& last) {
  file_ = Handle();
  check();
  if (target_.size == 0) throw RunError("HDF5 cannot close " + std::string(new_file));
  stored_.check(::ftruncate(stored_.descriptor(), static_cast<off_t>(target_.size)) != 0 ? errno : 0);
  if (last) stored_.check(last(stored_.descriptor(), target_.size));
  stored_.keep();
}

Source::Source(const std::filesystem::path& file) : path_(file) {
  silence();
  if (::access(file.c_str(), R_OK) != 0) refuse("", fmt::format("cannot be read: {}", std::generic_category().message(errno)));
  if (std::filesystem::is_directory(file)) refuse("", "is a folder, not an HDF5 file");
  const Handle access(H5Pcreate(H5P_FILE_ACCESS), H5Pclose);
  // Finished files never change, and locks fail on read-only and on some network file systems.
  H5Pset_file_locking(access.get(), false, true);
  file_ = Handle(H5Fopen(file.c_str(), H5F_ACC_RDONLY, access.get()), H5Fclose);
  if (!file_) refuse("", "is not an HDF5 file, or is damaged");
}

void Source::refuse(const std::string& what, const std::string& message) const {
  throw InputError({path_.string(), 0, 0}, what, message);
}

std::vector<std::string> Source::names(const std::string& group, bool datasets_only) const {
  const Handle handle(H5Gopen2(file_.get(), group.c_str(), H5P_DEFAULT), H5Gclose);
  if (!handle) refuse(group, "no such group");
  std::vector<std::string> names;
  const auto visit = [](hid_t, const char* name, const H5L_info_t*, void* list) -> herr_t {
    static_cast<std::vector<std::string>*>(list)->push_back(name);
    return 0;
  };
  if (H5Literate(handle.get(), H5_INDEX_NAME, H5_ITER_INC, nullptr, visit, &names) < 0) refuse(group, "cannot be listed");
  if (datasets_only) {
    std::erase_if(names, [&](const std::string& name) {
      H5O_info_t info;
      return H5Oget_info_by_name2(handle.get(), name.c_str(), &info, H5O_INFO_BASIC, H5P_DEFAULT) < 0 ||
             info.type != H5O_TYPE_DATASET;
    });
  }
  return names;
}

bool Source::contains(const std::string& path) const {
  return path == "/" ||
         (H5Lexists(file_.get(), path.c_str(), H5P_DEFAULT) > 0 && H5Oexists_by_name(file_.get(), path.c_str(), H5P_DEFAULT) > 0);
}

Handle Source::dataset(const std::string& path) const {
  Handle handle(H5Dopen2(file_.get(), path.c_str(), H5P_DEFAULT), H5Dclose);
  if (!handle) refuse(path, "no such dataset");
  return handle;
}

std::vector<std::size_t> Source::shape(const std::string& path) const {
  const Handle data = dataset(path);
  const Handle space(H5Dget_space(data.get()), H5Sclose);
  const int rank = H5Sget_simple_extent_ndims(space.get());
  if (rank < 1 || rank > 2) refuse(path, fmt::format("found {} dimensions; must be 1 or 2", rank));
  hsize_t extent[2] = {0, 0};
  H5Sget_simple_extent_dims(space.get(), extent, nullptr);
  return {extent, extent + rank};
}

void Source::read_rows(const std::string& path, std::size_t first, std::size_t rows, double* values) const {
  const std::vector<std::size_t> extent = shape(path);
  const Handle data = dataset(path);
  const Handle type(H5Dget_type(data.get()), H5Tclose);
  const H5T_class_t kind = H5Tget_class(type.get());
  if (kind != H5T_FLOAT && kind != H5T_INTEGER) refuse(path, "must hold numbers");
  if (rows == 0) return;
  const hsize_t begin[] = {first, 0}, count[] = {rows, extent.size() > 1 ? extent[1] : 1};
  const Handle file(H5Dget_space(data.get()), H5Sclose),
      memory(H5Screate_simple(static_cast<int>(extent.size()), count, nullptr), H5Sclose);
  if (H5Sselect_hyperslab(file.get(), H5S_SELECT_SET, begin, nullptr, count, nullptr) < 0 ||
      H5Dread(data.get(), H5T_NATIVE_DOUBLE, memory.get(), file.get(), H5P_DEFAULT, values) < 0)
    refuse(path, "cannot be read");
}

void Source::each_row(const std::string& path, std::span<const std::int64_t> numbers,
                      const std::function<void(std::size_t, std::span<const double>)>& use) const {
  constexpr std::int64_t piece = 1 << 17;  // rows
  const std::vector<std::size_t> extent = shape(path);
  const std::size_t width = extent.size() > 1 ? extent[1] : 1;
  if (!numbers.empty() && numbers.back() >= static_cast<std::int64_t>(extent[0]))
    refuse(path, fmt::format("has {} rows, and one of number {} is wanted", extent[0], numbers.back()));
  std::vector<double> rows;
  for (std::size_t begin = 0, end = 0; begin < numbers.size(); begin = end) {
    while (end < numbers.size() && numbers[end] < numbers[begin] + piece) ++end;
    const auto count = static_cast<std::size_t>(numbers[end - 1] - numbers[begin] + 1);
    rows.resize(count * width);
    read_rows(path, static_cast<std::size_t>(numbers[begin]), count, rows.data());
    for (std::size_t k = begin; k < end; ++k)
      use(k, std::span(rows).subspan(static_cast<std::size_t>(numbers[k] - numbers[begin]) * width, width));
  }
}

Source::Array Source::read(const std::string& path) const {
  Array array{shape(path), std::vector<double>(values(path))};
  read_rows(path, 0, array.rows(), array.data.data());
  return array;
}

std::size_t Source::values(const std::string& path) const {
  std::size_t values = 1;
  for (const std::size_t extent : shape(path)) values *= extent;
  return values;
}

std::vector<double> Source::read(const std::string& path, std::size_t first, std::size_t last) const {
  const std::vector<std::size_t> extent = shape(path);
  const std::size_t width = extent.size() > 1 ? std::max<std::size_t>(1, extent[1]) : 1;
  // The rows that hold these values.
  const std::size_t begin = first / width, count = (last + width - 1) / width - begin;
  std::vector<double> rows(count * width);
  if (rows.empty()) return rows;
  read_rows(path, begin, count, rows.data());
  rows.erase(rows.begin(), rows.begin() + static_cast<std::ptrdiff_t>(first - begin * width));
  rows.resize(last - first);
  return rows;
}

std::vector<std::byte> Source::read_bytes(const std::string& path) const {
  return read_bytes(path, 0, shape(path)[0]);
}

std::vector<std::byte> Source::read_bytes(const std::string& path, std::uint64_t first, std::size_t count) const {
  std::vector<std::byte> bytes(count);
  const Handle data = dataset(path);
  const Handle type(H5Dget_type(data.get()), H5Tclose);
  if (H5Tequal(type.get(), H5T_STD_U8LE) <= 0 || shape(path).size() != 1) refuse(path, "must be a flat dataset of bytes");
  if (count == 0) return bytes;
  const hsize_t begin = first, size = count;
  const Handle file(H5Dget_space(data.get()), H5Sclose), memory(H5Screate_simple(1, &size, nullptr), H5Sclose);
  if (H5Sselect_hyperslab(file.get(), H5S_SELECT_SET, &begin, nullptr, &size, nullptr) < 0 ||
      H5Dread(data.get(), H5T_NATIVE_UINT8, memory.get(), file.get(), H5P_DEFAULT, bytes.data()) < 0)
    refuse(path, "cannot be read");
  return bytes;
}

Handle Source::attribute(const std::string& group, const std::string& name) const {
  Handle handle(H5Aopen_by_name(file_.get(), group.c_str(), name.c_str(), H5P_DEFAULT, H5P_DEFAULT), H5Aclose);
  if (!handle) refuse(group, fmt::format("no attribute '{}'", name));
  return handle;
}

double Source::real(const std::string& group, const std::string& name) const {
  double value = 0;
  if (H5Aread(attribute(group, name).get(), H5T_NATIVE_DOUBLE, &value) < 0)
    refuse(group, fmt::format("'{}' is not a number", name));
  return value;
}

std::int64_t Source::integer(const std::string& group, const std::string& name) const {
  std::int64_t value = 0;
  if (H5Aread(attribute(group, name).get(), H5T_NATIVE_INT64, &value) < 0)
    refuse(group, fmt::format("'{}' is not a number", name));
  return value;
}

std::string Source::text(const std::string& group, const std::string& name) const {
  char* characters = nullptr;
  // Of an object behind an external link HDF5 1.10 looks for texts in the wrong file unless the object is open.
  const Handle type = utf8_type(name), object(H5Oopen(file_.get(), group.c_str(), H5P_DEFAULT), H5Oclose);
  if (!object) refuse(group, fmt::format("no attribute '{}'", name));
  const Handle handle(H5Aopen(object.get(), name.c_str(), H5P_DEFAULT), H5Aclose);
  if (!handle) refuse(group, fmt::format("no attribute '{}'", name));
  if (H5Aread(handle.get(), type.get(), &characters) < 0) refuse(group, fmt::format("'{}' is not text", name));
  const std::string text = characters ? characters : "";
  H5free_memory(characters);
  return text;
}

bool Source::has_attribute(const std::string& path, const std::string& name) const {
  return H5Aexists_by_name(file_.get(), path.c_str(), name.c_str(), H5P_DEFAULT) > 0;
}

}  // namespace perikit::hdf5
