#include "files/shared_file.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <linux/magic.h>
#include <sys/vfs.h>
#include <unistd.h>

#include <bit>
#include <cerrno>
#include <system_error>
#include <utility>

namespace perikit {

static_assert(std::endian::native == std::endian::little);

SharedFile::SharedFile(std::filesystem::path file)
    : file_(std::move(file)), descriptor_(::open(file_.c_str(), O_WRONLY | O_NOFOLLOW | O_CLOEXEC)) {
  struct statfs system {};
  if (!descriptor_ || ::fstatfs(descriptor_.get(), &system) != 0) {
    refusal_ = fmt::format("{} cannot be opened there: {}", file_.parent_path().string(), std::generic_category().message(errno));
    return;
  }
  const auto kind = static_cast<std::uint32_t>(system.f_type);
  constexpr std::uint32_t cifs = 0xff534d42;
  if (kind == NFS_SUPER_MAGIC || kind == SMB_SUPER_MAGIC || kind == SMB2_SUPER_MAGIC || kind == cifs)
    refusal_ = fmt::format("{} lies on a network file system that does not let several machines write one file",
                           file_.parent_path().string());
}

void SharedFile::write(std::uint64_t at, std::span<const double> values) noexcept {
  for (std::span<const std::byte> bytes = std::as_bytes(values); !bytes.empty() && error_ == 0;) {
    const ssize_t count = ::pwrite(descriptor_.get(), bytes.data(), bytes.size(), static_cast<off_t>(at));
    if (count < 0 && errno == EINTR) continue;
    if (count <= 0) {
      error_ = count < 0 ? errno : ENOSPC;
      return;
    }
    bytes = bytes.subspan(static_cast<std::size_t>(count));
    at += static_cast<std::uint64_t>(count);
  }
}

std::string SharedFile::close() noexcept {
  if (error_ == 0 && ::fsync(descriptor_.get()) != 0) error_ = errno;
  if (::close(descriptor_.release()) != 0 && error_ == 0) error_ = errno;
  return error_ == 0 ? std::string()
                     : fmt::format("{}: cannot write: {}", file_.string(), std::generic_category().message(error_));
}

}  // namespace perikit
