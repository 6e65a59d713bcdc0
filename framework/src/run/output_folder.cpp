#include "run/output_folder.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/file.h>

#include <algorithm>
#include <cerrno>
#include <span>
#include <system_error>

#include "core/fingerprint.hpp"
#include "perikit/core/errors.hpp"

namespace perikit {

namespace fs = std::filesystem;

namespace {

std::string seal_line(const std::string& text) {
  Fingerprint fingerprint;
  fingerprint.add(std::as_bytes(std::span(text)));
  return fmt::format("# written by perikit, which replaces its own results in this folder; seal {}\n", fingerprint.text());
}

/// Whether `file` lies in `folder` under `name`, or is the same file by another name.
bool reaches(const fs::path& file, const fs::path& folder, const std::string& name) {
  std::error_code error;
  const fs::path target = fs::weakly_canonical(folder / name, error), from = fs::weakly_canonical(file, error);
  if (std::mismatch(target.begin(), target.end(), from.begin(), from.end()).first == target.end()) return true;
  return fs::equivalent(folder / name, file, error);
}

void remove_temporaries(const fs::path& folder, const std::vector<std::string>& names) {
  std::error_code error;
  for (const auto& entry : fs::directory_iterator(folder, error)) {
    const std::string of = file_of_temporary(entry.path().filename().string());
    if (std::ranges::find(names, of) != names.end()) remove_file(entry.path());
  }
}

}  // namespace

std::optional<MarkedText> read_marked(const fs::path& file) {
  std::error_code error;
  if (!fs::is_regular_file(file, error)) return std::nullopt;
  std::string text = read_text(file);
  const std::size_t end = text.find('\n');
  if (end != std::string::npos) {
    std::string rest = text.substr(end + 1);
    if (text.substr(0, end + 1) == seal_line(rest)) return MarkedText{std::move(rest), true};
  }
  return MarkedText{std::move(text), false};
}

OutputFolder::OutputFolder(const fs::path& folder, const Use& use) : path_(folder), marker_(folder / use.marker) {
  refuse_inputs(use);
  make_folder(folder);
  take_lock();
  refuse_foreign(use);
  remove_temporaries(folder, use.names);
}

void OutputFolder::mark(const std::string& text) const {
  const std::string marked = seal_line(text) + text;
  store_atomically(marker_, std::as_bytes(std::span(marked)));
}

void OutputFolder::take_lock() {
  lock_ = Descriptor(::open(path_.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC));
  if (!lock_) throw_system_error(path_, "cannot open the folder", errno);
  locked_ = ::flock(lock_.get(), LOCK_EX | LOCK_NB) == 0;
  if (locked_ || errno != EWOULDBLOCK) return;  // some network file systems have no locks
  throw InputError({path_.string()}, "output",
                   "found the folder of another run or study that is writing into it; allowed: another folder (-o), or later");
}

void OutputFolder::refuse_inputs(const Use& use) const {
  for (const fs::path& input : use.inputs)
    for (const std::string& name : use.names) {
      if (!reaches(input, path_, name)) continue;
      throw InputError({path_.string()}, "output",
                       fmt::format("found {}, which is read, where {} would be written or removed; allowed: another folder (-o)",
                                   input.string(), (path_ / name).string()));
    }
}

void OutputFolder::refuse_foreign(const Use& use) const {
  std::optional<MarkedText> marker = read_marked(marker_);
  if (marker && marker->text.empty() && !marker->sealed) marker.reset();   // nothing is lost with it
  const bool own = marker ? marker->sealed : use.own;
  std::error_code error;
  for (const std::string& name : use.names) {
    const fs::path file = path_ / name;
    const fs::file_status status = fs::symlink_status(file, error);
    if (!fs::exists(status)) continue;
    const bool link = fs::is_symlink(status);
    if (link && use.force) remove_file(file);  // the link, not what it points to
    if (use.force || (own && !link)) continue;
    const std::string what = link                          ? "a symbolic link"
                             : marker && file == marker_ ? "a file that perikit did not write, or that was changed since"
                                                         : fmt::format("it beside no {} that perikit wrote", use.marker);
    throw InputError({file.string()}, "output", fmt::format("found {}; allowed: another folder (-o), or --force, which replaces it", what));
  }
}

}  // namespace perikit
