#pragma once
/// Runs gnuplot on a script.

#include <filesystem>
#include <string>

namespace perikit {

/// Terminal lines for a picture of the given size in pixels; the type follows from the file's extension (.png, .svg, .pdf).
/// Throws InputError for any other.
std::string gnuplot_terminal(const std::filesystem::path& picture, int width, int height);

/// Text in gnuplot's quotes.
std::string gnuplot_quoted(const std::string& text);

/// Feeds `script` (which may hold binary data) to gnuplot and stores what it draws in `picture`, whole or not at all.
/// Throws RunError where gnuplot is missing, complains, or draws nothing.
void run_gnuplot(const std::string& script, const std::filesystem::path& picture);

}  // namespace perikit
