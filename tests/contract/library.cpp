#include "tests/contract/library.hpp"

#include <doctest/doctest.h>
#include <fmt/format.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <cstring>

#include "tests/contract/fixture.hpp"

namespace perikit::contract {

namespace {

constexpr int no_suite = 3;   ///< exit status of a part's process
unsigned cases_run = 0;

/// Names the test cases that failed once more at the end, without their hundred messages.
class BrokenCases final : public doctest::IReporter {
 public:
  explicit BrokenCases(const doctest::ContextOptions&) {}
  void test_case_start(const doctest::TestCaseData& data) override { name_ = data.m_name; }
  void test_case_end(const doctest::CurrentTestCaseStats& stats) override {
    if (stats.failure_flags != 0) broken_.push_back(name_);
  }
  void test_run_end(const doctest::TestRunStats& stats) override {
    cases_run = stats.numTestCasesPassingFilters;
    for (const std::string& name : broken_) fmt::print("broken: {}\n", name);
    std::fflush(stdout);
  }
  void report_query(const doctest::QueryData&) override {}
  void test_run_start() override {}
  void test_case_reenter(const doctest::TestCaseData&) override {}
  void test_case_exception(const doctest::TestCaseException&) override {}
  void subcase_start(const doctest::SubcaseSignature&) override {}
  void subcase_end() override {}
  void log_assert(const doctest::AssertData&) override {}
  void log_message(const doctest::MessageData&) override {}
  void test_case_skipped(const doctest::TestCaseData&) override {}

 private:
  std::string name_;
  std::vector<std::string> broken_;
};

REGISTER_LISTENER("broken_cases", 1, BrokenCases);

int run_part(Kind kind, const std::string& part, int argc, char** argv) {
  subject().parts = {{kind, part}};
  doctest::Context context(argc, argv);
  context.addFilter("test-case", fmt::format("{}:*", name(kind)).c_str());
  context.setOption("no-version", true);
  context.setOption("no-path-filenames", true);
  context.setOption("no-skipped-summary", true);
  const int status = context.run();
  return cases_run == 0 ? no_suite : status;
}

/// How a part's process ended, in words; empty: it kept its contract.
std::string verdict(Kind kind, const std::string& part, int argc, char** argv) {
  std::fflush(nullptr);
  const pid_t child = ::fork();
  if (child < 0) return fmt::format("no process of its own: {}", std::strerror(errno));
  if (child == 0) {
    const int status = run_part(kind, part, argc, argv);
    std::fflush(nullptr);
    ::_exit(status);
  }
  int status = 0;
  while (::waitpid(child, &status, 0) < 0 && errno == EINTR) continue;
  if (WIFSIGNALED(status)) return fmt::format("crashes ({})", ::strsignal(WTERMSIG(status)));
  if (WEXITSTATUS(status) == no_suite) return "has no contract suite in this version";
  return WEXITSTATUS(status) == 0 ? "" : "breaks its contract";
}

}  // namespace

int run_library(const std::filesystem::path& library, int argc, char** argv) {
  std::string summary;
  bool kept = true;
  for (const auto& [kind, part] : subject().registry.parts_of(library)) {
    fmt::print("{}/{}\n", name(kind), part);
    const std::string fault = verdict(kind, part, argc, argv);
    summary += fmt::format("{}/{} {}\n", name(kind), part, fault.empty() ? "keeps its contract" : fault);
    kept = kept && fault.empty();
  }
  fmt::print("\n{}", summary);
  return kept ? 0 : 1;
}

}  // namespace perikit::contract
