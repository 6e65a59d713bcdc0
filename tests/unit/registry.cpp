#include "plugin/registry.hpp"

#include <doctest/doctest.h>
#include <fmt/format.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <atomic>
#include <fstream>
#include <iterator>
#include <thread>

#include "perikit/core/errors.hpp"
#include "perikit/influence.hpp"
#include "plugin/manifest.hpp"
#include "tests/kit/messages.hpp"

using namespace perikit;
using namespace perikit::test;
namespace fs = std::filesystem;

namespace {

fs::path built(const std::string& name) { return fs::path(PERIKIT_TEST_PLUGIN_FOLDER) / name / (name + ".so"); }

std::string bytes(const fs::path& file) {
  std::ifstream in(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

/// A folder of its own for one test case, removed at its end.
struct Folder {
  fs::path path = fs::temp_directory_path() / ("perikit_registry_" + std::to_string(getpid()) + "_" + std::to_string(count++));
  Folder() { fs::create_directories(path); }
  ~Folder() { fs::remove_all(path); }
  fs::path write(const std::string& name, const std::string& content) const {
    std::ofstream(path / name, std::ios::binary) << content;
    return path / name;
  }
  fs::path copy(const std::string& plugin, const std::string& name) const { return write(name, bytes(built(plugin))); }
  static inline int count = 0;
};

/// Opening `file` must fail with the file and `reason` in the message, and leave the registry as it was.
void check_refused(const fs::path& file, const std::string& reason) {
  Registry registry;
  const std::string message = message_of<InputError>([&] { registry.open(file); });
  CHECK_MESSAGE(message.find(reason) != std::string::npos, message);
  CHECK_MESSAGE(message.find(file.filename().string()) != std::string::npos, message);
  REQUIRE(registry.refused().size() == 1);
  CHECK(registry.refused().front().file == fs::weakly_canonical(file));
  CHECK(registry.refused().front().reason.find(reason) != std::string::npos);
  CHECK(registry.opened().empty());
  for (const Kind kind : all_kinds) CHECK(registry.names(kind).empty());
}

PartValues influence_values(const std::string& type) {
  PartValues values{Kind::influence, type, {}};
  values.values.set_path("family.influence");
  values.values.set_table_position({"scene.toml", 4, 1});
  return values;
}

}  // namespace

TEST_CASE("kinds and names are inverse") {
  for (const Kind kind : all_kinds) CHECK(kind_from_name(name(kind)) == kind);
  CHECK_FALSE(kind_from_name("Material"));
}

TEST_CASE("files that are no library are refused before the loader sees them") {
  const Folder folder;
  check_refused(folder.path / "absent.so", "no such file");
  check_refused(folder.write("text.so", "these are words, not code\n"), "not a shared library");
  check_refused(folder.write("empty.so", ""), "not a shared library");
  fs::create_directory(folder.path / "folder.so");
  check_refused(folder.path / "folder.so", "not a regular file");
  fs::create_symlink(folder.path / "nowhere", folder.path / "link.so");
  Registry registry;
  registry.add_folder(folder.path);
  CHECK(registry.refused().size() == 4);  // text, empty, folder, link
}

TEST_CASE("a truncated library is refused at every length") {
  const Folder folder;
  const std::string whole = bytes(built("good"));
  REQUIRE(whole.size() > 4096);
  for (const std::size_t length : {std::size_t{5}, std::size_t{20}, std::size_t{64}, std::size_t{200}, whole.size() / 4, whole.size() / 2,
                                   3 * whole.size() / 4, whole.size() - 100, whole.size() - 1}) {
    CAPTURE(length);
    check_refused(folder.write("half_" + std::to_string(length) + ".so", whole.substr(0, length)), "truncated");
  }
}

TEST_CASE("a library damaged inside does not take the program down") {
  const Folder folder;
  std::string damaged = bytes(built("good"));
  for (std::size_t i = 0x200; i < damaged.size() - 0x2000; ++i) damaged[i] = static_cast<char>(i * 37);  // headers stay sound
  Registry registry;
  CHECK_THROWS_AS(registry.open(folder.write("damaged.so", damaged)), InputError);
}

TEST_CASE("what the loader refuses carries its reason") {
  const Folder folder;
  check_refused(built("undefined_symbol"), "perikit_symbol_of_a_later_version");
  std::string other = bytes(built("good"));
  const std::string soname = "libperikit.so." PERIKIT_STRINGIFY(PERIKIT_ABI_VERSION);
  REQUIRE(other.find(soname) != std::string::npos);
  other.replace(other.find(soname), soname.size(), "libperikit.so.7");
  check_refused(folder.write("other_soname.so", other), "libperikit.so.7");
}

TEST_CASE("ABI, build and symbols are compared before any object crosses") {
  check_refused(built("missing_symbol"), "symbol perikit_register missing: PERIKIT_PLUGIN(registrar) {");
  check_refused(built("other_abi"), fmt::format("ABI version {}, this program has {}", PERIKIT_ABI_VERSION + 6, PERIKIT_ABI_VERSION));
  check_refused(built("other_build"), "built as 'msvc19 abacus'");
  check_refused(built("other_headers"),
                fmt::format("headers-000000000000', this program as '{}': perikit's headers are others now; build it again",
                            PERIKIT_BUILD_ID));
}

TEST_CASE("a library for another level of the processor is refused with both levels and the remedy") {
  const std::string own = fmt::format(", this program for level {}: cmake -D perikit_DIR=/", PERIKIT_LEVEL);
#if defined(__x86_64__)
  const std::string level = PERIKIT_LEVEL;
  check_refused(built("other_level"), fmt::format("built for level {}x86-64{}", level.starts_with("native-") ? "native-" : "", own));
#endif
  // A manifest says so without the library being opened: this one would end the program.
  const Folder folder;
  const fs::path library = folder.copy("crashing_constructor", "other.so");
  write_manifest(library, {{Kind::influence, "other", ""}});
  std::string text = bytes(manifest_path(library));
  const std::string id = PERIKIT_LEVEL " " PERIKIT_SIMD_ID;
  REQUIRE(text.find(id) != std::string::npos);
  folder.write("other.parts", text.replace(text.find(id), id.size(), "x86-64-v9 simd1024"));
  Registry registry;
  registry.add_folder(folder.path);
  CHECK(registry.names(Kind::influence).empty());
  REQUIRE(registry.refused().size() == 1);
  CHECK_MESSAGE(registry.refused()[0].reason.find("built for level x86-64-v9" + own) == 0, registry.refused()[0].reason);
  // Where the compiler differs too, that is said instead.
  folder.write("other.parts", text.replace(text.find("cxx11abi"), 8, "cxx17abi"));
  Registry another;
  another.add_folder(folder.path);
  REQUIRE(another.refused().size() == 1);
  CHECK(another.refused()[0].reason.find("built as '") == 0);
}

TEST_CASE("a failed registration leaves nothing behind") {
  check_refused(built("throwing_registration"), "licence server unreachable");
  check_refused(built("throwing_number"), "no std::exception");
  check_refused(built("registers_nothing"), "registers no part");
  check_refused(built("crashing_constructor"), "kills the process");
  check_refused(built("exiting_constructor"), "ends the process that loads it (exit status 0)");
}

TEST_CASE("without a process to try it in, a library is refused") {
  const Folder folder;
  const fs::path library = folder.copy("good", "good.so");
  const pid_t child = fork();
  if (child == 0) {  // the limit cannot be undone, and does not bind root
    const rlimit none{0, 0};
    if (setrlimit(RLIMIT_NPROC, &none) != 0 || (getuid() == 0 && setuid(65534) != 0)) _exit(2);
    _exit(message_of<InputError>([&] { Registry().open(library); }).find("no process to try it in") != std::string::npos ? 0 : 1);
  }
  int status = -1;
  REQUIRE(waitpid(child, &status, 0) == child);
  CHECK(status == 0);
}

TEST_CASE("bad descriptions are refused with part and reason") {
  check_refused(built("nameless"), "influence '': it has no name: {.name = \"its_name\", ...}");
  check_refused(built("nameless_parameter"), "influence 'bell': the parameter \"Width of the bell.\" has no name: table.number(\"its_name\", ...)");
  check_refused(built("bad_names"), "influence 'CamelCase': the name must be snake_case");
  check_refused(built("bad_underscores"), "influence 'two__lines': the name must be snake_case");
  check_refused(built("trailing_underscore"), "influence 'private_': the name must be snake_case");
  check_refused(built("broken_example"), "influence 'unreadable': example \"order = = 1\" is not valid TOML");
  check_refused(built("typed_example"), "influence 'typed': an example must leave out 'type'");
  check_refused(built("bad_parameters"), "influence 'twice': parameter 'order' is declared twice");
  check_refused(built("bad_examples"), "influence 'unexampled': at least one example");
  check_refused(built("bad_summary"), "influence 'silent': the summary must be one line");
}

TEST_CASE("a duplicate is refused with both files named, and whole") {
  Registry registry;
  registry.open(built("good"));
  const std::string message = message_of<InputError>([&] { registry.open(built("duplicate")); });
  CHECK(message.find("influence 'sound': duplicate") != std::string::npos);
  CHECK(message.find("good.so") != std::string::npos);
  CHECK(message.find("duplicate.so") != std::string::npos);
  CHECK(registry.names(Kind::influence) == std::vector<std::string>{"sound"});
  CHECK(registry.library_of(Kind::influence, "sound") == fs::weakly_canonical(built("good")));
}

TEST_CASE("a duplicate named by manifests is refused without opening either") {
  const Folder folder;
  write_manifest(folder.copy("good", "a.so"), {{Kind::influence, "sound", "first"}});
  write_manifest(folder.copy("duplicate", "b.so"), {{Kind::influence, "before_sound", "own"}, {Kind::influence, "sound", "second"}});
  Registry registry;
  registry.add_folder(folder.path);
  CHECK(registry.opened().empty());
  CHECK(registry.names(Kind::influence) == std::vector<std::string>{"sound"});
  REQUIRE(registry.refused().size() == 1);
  CHECK(registry.refused()[0].file.filename() == "b.so");
  CHECK(registry.refused()[0].reason.find("a.so") != std::string::npos);
}

TEST_CASE("a library is opened only when one of its parts is asked for, once") {
  const Folder folder;
  const fs::path library = folder.copy("good", "good.so");
  write_manifest(library, {{Kind::influence, "sound", "omega = 1"}});
  folder.copy("bad_factories", "other.so");
  write_manifest(folder.path / "other.so", {{Kind::influence, "null", ""}, {Kind::influence, "throws", ""}, {Kind::influence, "explains", ""}});
  Registry registry;
  registry.add_folder(folder.path);
  CHECK(registry.refused().empty());
  CHECK(registry.known(Kind::influence, "sound"));
  CHECK(registry.names(Kind::influence).size() == 4);
  CHECK(registry.parts_of(library).empty());
  CHECK(registry.opened().empty());
  CHECK(registry.describe(Kind::influence, "sound").summary == "omega = 1");
  registry.describe(Kind::influence, "sound");
  CHECK(registry.opened() == std::vector<fs::path>{fs::weakly_canonical(library)});
  CHECK(registry.parts_of(library) == std::vector<std::pair<Kind, std::string>>{{Kind::influence, "sound"}});
  const double r[] = {0.5, 1.0};
  double omega[2];
  registry.influence(influence_values("sound"))->evaluate(r, omega);
  CHECK(omega[1] == 1.0);
}

TEST_CASE("a stale manifest is not believed, a bad one is refused by name, and the library is asked instead") {
  const Folder folder;
  const fs::path library = folder.copy("good", "good.so");
  const fs::path manifest = manifest_path(library);
  write_manifest(library, {{Kind::influence, "of_an_older_build", ""}});
  const std::string good = bytes(manifest);
  SUBCASE("library changed") {
    std::ofstream(library, std::ios::app | std::ios::binary) << "x";
    Registry registry;
    registry.add_folder(folder.path);
    CHECK(registry.names(Kind::influence) == std::vector<std::string>{"sound"});
    CHECK(registry.opened().empty());   // asked in another process, and opened in this one when a part is wanted
    CHECK(registry.describe(Kind::influence, "sound").summary == "omega = 1");
    CHECK(registry.opened().size() == 1);
    CHECK(registry.refused().empty());
  }
  SUBCASE("manifest links to itself, or to nowhere") {
    for (const char* target : {"good.parts", "nowhere"}) {
      fs::remove(manifest);
      fs::create_symlink(target, manifest);
      Registry registry;
      registry.add_folder(folder.path);
      CHECK(registry.names(Kind::influence) == std::vector<std::string>{"sound"});
      REQUIRE(registry.refused().size() == 1);
      CHECK(registry.refused()[0].file.filename() == "good.parts");
      CHECK(registry.refused()[0].reason.find("not a regular file") != std::string::npos);
    }
  }
  SUBCASE("manifest unreadable") {
    const std::string wrong_kind = std::string(good).replace(good.find("'influence'"), 11, "'elephants'");
    const std::string wrong_name = std::string(good).replace(good.find("of_an_older_build"), 17, "of__older_build__");
    write_manifest(library, {{Kind::influence, "sound", ""}, {Kind::influence, "sound", "again"}});
    const std::string twice = bytes(manifest);
    for (const std::string& content : {wrong_name, twice, std::string("format = "), std::string("\0\xff\xfe", 3), std::string(), std::string("format = 1"),
                                       std::string("format = 7"), good.substr(0, good.size() / 2), wrong_kind, std::string(2 << 20, '#')}) {
      folder.write("good.parts", content);
      Registry registry;
      registry.add_folder(folder.path);
      CHECK(registry.names(Kind::influence) == std::vector<std::string>{"sound"});
      REQUIRE(registry.refused().size() == 1);
      CHECK(registry.refused()[0].file.filename() == "good.parts");
      CHECK(registry.refused()[0].reason.find("bad manifest") != std::string::npos);
    }
  }
}

TEST_CASE("a scan reads manifests alone; a library that changed since then is tried in a child process before it is opened") {
  const Folder folder;
  const fs::path library = folder.copy("good", "good.so");
  write_manifest(library, {{Kind::influence, "sound", ""}, {Kind::influence, "promised", ""}});
  std::string other = bytes(built("good"));
  SUBCASE("into one that kills its process") {
    Registry registry;
    registry.add_folder(folder.path);
    folder.copy("crashing_constructor", "good.so");
    CHECK(message_of<InputError>([&] { registry.describe(Kind::influence, "sound"); }).find("kills the process") != std::string::npos);
    CHECK(registry.names(Kind::influence).empty());
  }
  SUBCASE("into one of the same size with other bytes: damaged, and refused") {
    other.back() = static_cast<char>(other.back() + 1);  // the end of the section table, which the loader does not read
    Registry registry;
    folder.write("good.so", other);
    registry.add_folder(folder.path);
    CHECK(registry.names(Kind::influence) == std::vector<std::string>{"promised", "sound"});
    const std::string error = message_of<InputError>([&] { registry.describe(Kind::influence, "sound"); });
    CHECK_MESSAGE(error.find("its bytes are not those that good.parts describes") != std::string::npos, error);
    CHECK(registry.names(Kind::influence).empty());
    REQUIRE(registry.refused().size() == 1);
  }
  SUBCASE("into one of another size: what the manifest named is forgotten") {
    Registry registry;
    registry.add_folder(folder.path);
    CHECK(registry.names(Kind::influence) == std::vector<std::string>{"promised", "sound"});
    folder.write("good.so", other + " ");
    CHECK(message_of<InputError>([&] { registry.describe(Kind::influence, "promised"); }).find("found the unknown influence 'promised'") == 0);
    CHECK(registry.names(Kind::influence) == std::vector<std::string>{"sound"});
    CHECK(registry.refused().empty());
  }
}

TEST_CASE("manifests of one library written at once do not meet") {
  const Folder folder;
  const fs::path library = folder.copy("good", "good.so");
  fs::create_directory(folder.path / "good.parts.new");
  std::atomic<int> failures{0};
  const auto write = [&] {
    for (int i = 0; i < 25; ++i) {
      try {
        write_manifest(library, {{Kind::influence, "sound", ""}});
        read_manifest(manifest_path(library));
      } catch (const std::exception&) {
        ++failures;
      }
    }
  };
  std::thread first(write), second(write);
  first.join();
  second.join();
  CHECK(failures == 0);
  CHECK(std::distance(fs::directory_iterator(folder.path), {}) == 3);  // library, manifest, the folder above
}

TEST_CASE("a manifest that names what the library does not register: refused when it is asked for") {
  const Folder folder;
  write_manifest(folder.copy("good", "good.so"), {{Kind::influence, "promised", ""}, {Kind::influence, "sound", ""}});
  Registry registry;
  registry.add_folder(folder.path);
  CHECK(message_of<InputError>([&] { registry.describe(Kind::influence, "sound"); }).find("names 'promised'") != std::string::npos);
  CHECK(registry.names(Kind::influence).empty());
}

TEST_CASE("a manifest of another ABI refuses its library without opening it") {
  const Folder folder;
  const fs::path library = folder.copy("crashing_constructor", "old.so");
  write_manifest(library, {{Kind::influence, "old", ""}});
  std::string text = bytes(manifest_path(library));
  const std::string abi = "abi = " + std::to_string(PERIKIT_ABI_VERSION);
  text.replace(text.find(abi), abi.size(), "abi = 7");
  folder.write("old.parts", text);
  Registry registry;
  registry.add_folder(folder.path);
  REQUIRE(registry.refused().size() == 1);
  CHECK(registry.refused()[0].reason == fmt::format("ABI version 7, this program has {}", PERIKIT_ABI_VERSION));
}

TEST_CASE("an unknown name gets the nearest, the known ones and the refused libraries") {
  const Folder folder;
  folder.write("text.so", "words");
  folder.copy("good", "good.so");
  Registry registry;
  registry.add_folder(folder.path);
  const std::string message = message_of<InputError>([&] { registry.describe(Kind::influence, "sund"); });
  CHECK(message.find("found the unknown influence 'sund'; allowed: sound; did you mean 'sound'?; refused libraries") == 0);
  CHECK(message.find("text.so (not a shared library (ELF magic missing))") != std::string::npos);
  CHECK(message_of<InputError>([&] { Registry().library_of(Kind::material, "steel"); }) ==
        "found the unknown material 'steel'; allowed: none, no library brings any; parts in other folders: --plugin-path, PERIKIT_PLUGIN_PATH");
}

TEST_CASE("a factory that throws or returns null names part and library") {
  Registry registry;
  registry.open(built("bad_factories"));
  const auto create = [&](const std::string& type) { return message_of<InputError>([&] { registry.influence(influence_values(type)); }); };
  const std::string place = "scene.toml:4:1: family.influence: influence ";
  CHECK(create("throws").find(place + "'throws' of ") == 0);
  CHECK(create("throws").find("bad_factories.so cannot be made: table not found") != std::string::npos);
  CHECK(create("null").find("bad_factories.so cannot be made: its factory returned nothing") != std::string::npos);
  CHECK(create("explains") == "scene.toml:3:1: its own text");
}

TEST_CASE("search path: given folders, the environment, the folder beside the library") {
  setenv("PERIKIT_PLUGIN_PATH", "/one::/two", 1);
  const auto path = Registry::standard_search_path({"/zero"});
  unsetenv("PERIKIT_PLUGIN_PATH");
  REQUIRE(path.size() >= 3);
  CHECK(path[0] == "/zero");
  CHECK(path[1] == "/one");
  CHECK(path[2] == "/two");
  if (fs::is_directory(PERIKIT_PLUGIN_FOLDER)) CHECK(path.back() == fs::weakly_canonical(PERIKIT_PLUGIN_FOLDER));
  CHECK(message_of<InputError>([] { Registry().add_folder("/no/such/folder"); }).find("/no/such/folder: this plugin folder cannot be read") == 0);
}
