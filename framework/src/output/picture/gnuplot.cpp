#include "output/picture/gnuplot.hpp"

#include <fmt/format.h>
#include <spawn.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <cstring>
#include <memory>
#include <vector>

#include "files/atomic_file.hpp"
#include "output/recorder.hpp"
#include "perikit/core/errors.hpp"

namespace perikit {

namespace {

using TemporaryFile = std::unique_ptr<std::FILE, int (*)(std::FILE*)>;

TemporaryFile temporary_file() {
  TemporaryFile file(std::tmpfile(), std::fclose);
  if (!file) throw_system_error("gnuplot", "cannot make a temporary file", errno);
  return file;
}

std::string contents(std::FILE* file) {
  std::string text;
  std::vector<char> buffer(1 << 16);
  for (std::rewind(file); const std::size_t count = std::fread(buffer.data(), 1, buffer.size(), file);)
    text.append(buffer.data(), count);
  return text;
}

/// A gnuplot that ends early must not end this program by SIGPIPE, hence send() on a socket in place of write() on a pipe.
void feed(int socket, const std::string& script) {
  for (std::size_t sent = 0; sent < script.size();) {
    const ssize_t count = ::send(socket, script.data() + sent, script.size() - sent, MSG_NOSIGNAL);
    if (count < 0 && errno == EINTR) continue;
    if (count < 0) return;  // it has ended; its status and messages tell why
    sent += static_cast<std::size_t>(count);
  }
}

pid_t start_gnuplot(int input, int output, int messages) {
  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  posix_spawn_file_actions_adddup2(&actions, input, STDIN_FILENO);
  posix_spawn_file_actions_adddup2(&actions, output, STDOUT_FILENO);
  posix_spawn_file_actions_adddup2(&actions, messages, STDERR_FILENO);
  char name[] = "gnuplot", no_settings[] = "-d";
  char* arguments[] = {name, no_settings, nullptr};
  pid_t child = 0;
  const int code = ::posix_spawnp(&child, name, &actions, nullptr, arguments, environ);
  posix_spawn_file_actions_destroy(&actions);
  if (code == ENOENT) throw RunError("gnuplot is not installed (Debian: gnuplot-nox); results.xdmf opens in ParaView without it");
  if (code != 0) throw_system_error("gnuplot", "cannot be started", code);
  return child;
}

}  // namespace

std::string gnuplot_terminal(const std::filesystem::path& picture, int width, int height) {
  const std::string extension = picture.extension().string();
  const std::string font = "font 'DejaVu Sans,18'";
  const std::string size = fmt::format("size {},{}", width, height);
  std::string terminal;
  if (extension == ".png") {
    terminal = fmt::format(
        "if (strstrt(GPVAL_TERMINALS, 'pngcairo') > 0) {{ set terminal pngcairo noenhanced {0} {1} }} "
        "else {{ set terminal png noenhanced {0} {1} }}",
        size, font);
  } else if (extension == ".svg") {
    terminal = fmt::format("set terminal svg noenhanced {} {} background 'white'", size, font);
  } else if (extension == ".pdf") {
    constexpr double pixels_per_inch = 160;
    terminal = fmt::format("set terminal pdfcairo noenhanced size {}in,{}in font 'DejaVu Sans,8'", width / pixels_per_inch,
                           height / pixels_per_inch);
  } else {
    throw InputError({}, "output", fmt::format("found '{}'; must end in .png, .svg or .pdf", picture.string()));
  }
  return "set encoding utf8\n" + terminal + "\n";
}

std::string gnuplot_quoted(const std::string& text) {
  std::string quoted = "'";
  for (const char c : text) {
    if (c == '\'') quoted += '\'';
    quoted += static_cast<unsigned char>(c) < 0x20 ? ' ' : c;
  }
  return quoted + "'";
}

void run_gnuplot(const std::string& script, const std::filesystem::path& picture) {
  const TemporaryFile output = temporary_file(), messages = temporary_file();
  int ends[2];
  if (::socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, ends) != 0) throw_system_error("gnuplot", "cannot be started", errno);
  Descriptor ours(ends[0]), theirs(ends[1]);
  const pid_t child = start_gnuplot(theirs.get(), ::fileno(output.get()), ::fileno(messages.get()));
  theirs = Descriptor();
  feed(ours.get(), script);
  ours = Descriptor();
  int status = 0;
  while (::waitpid(child, &status, 0) < 0 && errno == EINTR) continue;
  const std::string drawn = contents(output.get());
  if (status != 0 || drawn.empty()) {
    throw RunError(fmt::format("{}: gnuplot could not draw: {}", picture.string(), contents(messages.get())));
  }
  write_file_atomically(picture, drawn);
}

}  // namespace perikit
