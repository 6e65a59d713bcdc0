#include "tests/contract/report.hpp"

#include <doctest/doctest.h>
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <cstdio>
#include <filesystem>
#include <set>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

namespace perikit::contract {

namespace {

unsigned cases = 0;

/// On one line: the tables of examples have several.
std::string on_one_line(std::string text) {
  for (std::size_t at = 0; (at = text.find('\n', at)) != std::string::npos; at += 2) text.replace(at, 1, "; ");
  return text;
}

/// What INFO and the message of the check say: "baqp () 2D lattice: forces depend on the unit of length: 3e-3".
std::string circumstances() {
  std::vector<std::string> words;
  for (int k = 0; k < doctest::IReporter::get_num_active_contexts(); ++k) {
    std::ostringstream text;
    doctest::IReporter::get_active_contexts()[k]->stringify(&text);
    const std::string line = on_one_line(text.str());
    if (!words.empty() && line.starts_with(words.back())) words.pop_back();   // said again, with more
    words.push_back(line);
  }
  return fmt::format("{}", fmt::join(words, ": "));
}

class Report final : public doctest::IReporter {
 public:
  explicit Report(const doctest::ContextOptions&) {}

  void test_case_start(const doctest::TestCaseData& data) override {
    name_ = data.m_name;
    checks_.clear();
    findings_.clear();
    failures_ = 0;
  }

  void log_assert(const doctest::AssertData& data) override {
    if (!data.m_failed) return;
    ++failures_;
    if (!checks_.emplace(data.m_file, data.m_line).second) return;
    std::string values = data.m_threw ? fmt::format(", which threw: {}", data.m_exception.c_str()) : "";
    if (const std::string shown = data.m_decomp.c_str(); !data.m_threw && shown != "false" && !shown.empty()) values = ", here " + shown;
    const std::string place = std::filesystem::path(data.m_file).filename();
    const std::string where = circumstances();
    findings_ += fmt::format("{}    expected {}{}   ({}:{})\n", where.empty() ? "" : "  " + where + "\n", data.m_expr, values, place, data.m_line);
  }

  void test_case_exception(const doctest::TestCaseException& data) override {
    ++failures_;
    findings_ += fmt::format("  {} {}\n", data.is_crash ? "crashed:" : "ended by an exception:", data.error_string.c_str());
  }

  void log_message(const doctest::MessageData& data) override {
    if (notes_.insert(data.m_string.c_str()).second) fmt::print("note:   {}\n", data.m_string.c_str());
  }

  void test_case_end(const doctest::CurrentTestCaseStats& stats) override {
    const bool kept = stats.failure_flags == 0;
    fmt::print("{} {}\n{}", kept ? "kept:  " : "broken:", name_, findings_);
    const std::size_t shown = checks_.size();
    if (failures_ > shown && shown > 0) fmt::print("  and {} times more\n", failures_ - shown);
    std::fflush(stdout);
  }

  void test_run_end(const doctest::TestRunStats& stats) override {
    cases = stats.numTestCasesPassingFilters;
    if (cases == 0) return;
    fmt::print("{} of {} test cases kept; {} checks, {} failed\n", cases - stats.numTestCasesFailed, cases, stats.numAsserts, stats.numAssertsFailed);
  }

  void report_query(const doctest::QueryData&) override {}
  void test_run_start() override {}
  void test_case_reenter(const doctest::TestCaseData&) override {}
  void subcase_start(const doctest::SubcaseSignature&) override {}
  void subcase_end() override {}
  void test_case_skipped(const doctest::TestCaseData&) override {}

 private:
  std::string name_, findings_;
  std::set<std::pair<std::string, int>> checks_;   ///< file and line of what failed in this test case
  std::set<std::string> notes_;
  std::size_t failures_ = 0;
};

REGISTER_REPORTER(report_name, 1, Report);

}  // namespace

unsigned cases_run() noexcept { return cases; }

}  // namespace perikit::contract
