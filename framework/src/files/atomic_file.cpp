#include "files/atomic_file.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include <cerrno>
#include <fstream>
#include <iterator>
#include <system_error>
#include <utility>

#include "perikit/core/errors.hpp"

namespace perikit {

namespace {

/// Makes the new name itself last. File systems that cannot sync a folder say EINVAL; there is nothing more to do then.
void sync_folder(const std::filesystem::path& file) {
  const std::filesystem::path folder = file.has_parent_path() ? file.parent_path() : ".";
  const Descriptor descriptor(::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC));
  if (!descriptor) throw_system_error(folder, "cannot open the folder", errno);
  if (::fsync(descriptor.get()) != 0 && errno != EINVAL) throw_system_error(folder, "cannot write the folder", errno);
}

}  // namespace

Descriptor& Descriptor::operator=(Descriptor&& other) noexcept {
  std::swap(value_, other.value_);
  return *this;
}

Descriptor::~Descriptor() {
  if (value_ >= 0) ::close(value_);
}

int Descriptor::release() noexcept {
  return std::exchange(value_, -1);
}

void throw_system_error(const std::filesystem::path& file, const std::string& action, int code) {
  throw RunError(fmt::format("{}: {}: {}", file.string(), action, std::generic_category().message(code)));
}

std::filesystem::path temporary_name(const std::filesystem::path& file) {
  return file.parent_path() / fmt::format(".{}.{}.part", file.filename().string(), ::getpid());
}

std::string file_of_temporary(const std::string& name) {
  const std::string end = ".part";
  if (!name.starts_with('.') || !name.ends_with(end)) return {};
  const std::string middle = name.substr(1, name.size() - 1 - end.size());
  const std::size_t dot = middle.rfind('.');
  const bool numbered =
      dot != std::string::npos && dot + 1 < middle.size() && middle.find_first_not_of("0123456789", dot + 1) == std::string::npos;
  return numbered ? middle.substr(0, dot) : std::string();
}

int write_all(int descriptor, std::span<const std::byte> bytes) noexcept {
  while (!bytes.empty()) {
    const ssize_t count = ::write(descriptor, bytes.data(), bytes.size());
    if (count < 0 && errno == EINTR) continue;
    if (count < 0) return errno;
    if (count == 0) return ENOSPC;
    bytes = bytes.subspan(static_cast<std::size_t>(count));
  }
  return 0;
}

AtomicFile::AtomicFile(std::filesystem::path file) : file_(std::move(file)), temporary_(temporary_name(file_)) {
  // Never through a link, nor into a file that is there: one of this name is left from a process of the same number.
  const auto open_new = [&] { return ::open(temporary_.c_str(), O_RDWR | O_CREAT | O_EXCL | O_NOFOLLOW | O_CLOEXEC, 0666); };
  descriptor_ = Descriptor(open_new());
  if (!descriptor_ && errno == EEXIST && ::unlink(temporary_.c_str()) == 0) descriptor_ = Descriptor(open_new());
  if (!descriptor_) throw_system_error(file_, "cannot write", errno);
}

AtomicFile::~AtomicFile() {
  if (!kept_) ::unlink(temporary_.c_str());
}

void AtomicFile::check(int code) const {
  if (code != 0) throw_system_error(file_, "cannot write", code);
}

void AtomicFile::keep() {
  check(::fsync(descriptor_.get()) != 0 ? errno : 0);
  // Network file systems report a full disk only here.
  check(::close(descriptor_.release()) != 0 ? errno : 0);
  check(::rename(temporary_.c_str(), file_.c_str()) != 0 ? errno : 0);
  kept_ = true;
  sync_folder(file_);
}

void store_atomically(const std::filesystem::path& file, std::span<const std::byte> bytes, std::span<const std::byte> more) {
  AtomicFile out(file);
  for (const auto part : {bytes, more}) out.check(write_all(out.descriptor(), part));
  out.keep();
}

void make_folder(const std::filesystem::path& folder) {
  std::error_code error;
  std::filesystem::create_directories(folder, error);
  if (!error && !std::filesystem::is_directory(folder, error) && !error) error = std::make_error_code(std::errc::not_a_directory);
  if (error) throw_system_error(folder, "cannot create the folder", error.value());
}

void remove_file(const std::filesystem::path& file) {
  std::error_code error;
  std::filesystem::remove(file, error);
  if (error) throw_system_error(file, "cannot remove", error.value());
}

std::string read_text(const std::filesystem::path& file) {
  std::ifstream stream(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(stream), {}};
}

}  // namespace perikit
