#include <fmt/format.h>
#include <sys/resource.h>

#include <algorithm>
#include <future>
#include <optional>
#include <system_error>
#include <type_traits>

#include "files/atomic_file.hpp"
#include "files/hdf5_file.hpp"
#include "output/recorder.hpp"
#include "output/result_file.hpp"
#include "output/xdmf.hpp"
#include "output_fields/state_field.hpp"
#include "perikit/core/errors.hpp"

namespace perikit {

namespace fs = std::filesystem;

namespace {

/// Frames from `first_frame` on, and temporaries that a killed run left behind.
void remove_later_frames(const fs::path& frames, std::int64_t first_frame) {
  std::vector<fs::path> stale;
  std::error_code error;
  fs::directory_iterator entries(frames, error);
  if (error) throw_system_error(frames, "cannot list the folder", error.value());
  for (const fs::directory_entry& entry : entries) {
    const std::string name = entry.path().filename().string();
    const bool frame = entry.path().extension() == ".h5" && frame_index(entry.path().stem().string()) >= first_frame;
    if (frame || file_of_temporary(name).ends_with(".h5")) stale.push_back(entry.path());
  }
  for (const fs::path& file : stale) remove_file(file);
}

/// The heap of a new thread takes 128 MB of addresses, which others may need where the shell allows but so many.
bool addresses_limited() {
  rlimit limit{};
  return getrlimit(RLIMIT_AS, &limit) == 0 && limit.rlim_cur != RLIM_INFINITY;
}

void write_run_attributes(hdf5::NewFile& file, const RunAttributes& run) {
  file.attribute("perikit_version", run.perikit_version);
  file.attribute("title", run.title);
  file.attribute("scene", run.scene);
}

/// A column, a piece at a time; add_values(p, values) appends those of a point.
template <class Value, class ValuesOf>
void store_column(hdf5::StoredFile& file, const std::string& name, std::size_t points, int width, ValuesOf&& add_values) {
  constexpr std::size_t piece = 1 << 16;
  hdf5::NewFile::Rows rows =
      file.rows(name, points, width, std::is_same_v<Value, double> ? hdf5::NewFile::Numbers::real : hdf5::NewFile::Numbers::whole);
  std::vector<Value> values;
  for (std::size_t first = 0; first < points; first += piece) {
    values.clear();
    for (std::size_t p = first; p < std::min(points, first + piece); ++p) add_values(p, values);
    rows.append(std::span<const Value>(values));
  }
}

void store_reference(const fs::path& path, const ReferenceData& reference, const RunAttributes& run) {
  hdf5::StoredFile file(path);
  write_run_attributes(file, run);
  using Real = std::vector<double>;
  using Whole = std::vector<std::int64_t>;
  const std::size_t points = reference.points;
  const auto number = [](std::size_t p, Whole& values) { values.push_back(static_cast<std::int64_t>(p)); };
  store_column<double>(file, "position", points, 3, [&](std::size_t p, Real& values) {
    const std::array<double, 3> x = reference.point(p).position;
    values.insert(values.end(), x.begin(), x.end());
  });
  store_column<double>(file, "volume", points, 1, [&](std::size_t p, Real& values) { values.push_back(reference.point(p).volume); });
  store_column<std::int64_t>(file, "id", points, 1, number);
  store_column<std::int64_t>(file, "material_id", points, 1,
                             [&](std::size_t p, Whole& values) { values.push_back(reference.point(p).material_id); });
  for (const auto& [name, set] : reference.sets) {
    if (set.size() == 0) {
      file.dataset("set_" + name, Whole());
      continue;
    }
    hdf5::NewFile::Rows rows = file.rows("set_" + name, set.size(), 1, hdf5::NewFile::Numbers::whole);
    set.each([&](std::span<const std::int64_t> ids) {
      if (!ids.empty()) rows.append(ids);
    });
  }
  store_column<std::int64_t>(file, "connectivity", points, 1, number);
  file.keep();
}

}  // namespace

struct FrameWriter::Implementation {
  fs::path folder;
  RunAttributes run;
  std::size_t points = 0;
  std::int64_t frames = 0;         ///< complete and listed
  hdf5::Image results;             ///< grows by one link per frame
  std::vector<std::string> grids;  ///< of the sidecar, one per frame

  /// The one that is being put together, and then stored.
  struct Frame {
    explicit Frame(const fs::path& path) : file(path) {}
    double time = 0;
    hdf5::StoredFile file;
    std::vector<XdmfField> fields;
    std::optional<hdf5::NewFile::Rows> rows;  ///< of the last field
    std::size_t values = 0;                   ///< of it so far
  };
  std::optional<Frame> frame;
  std::future<void> storing;       ///< of `frame`, on a thread of its own

  std::filesystem::path next_file() const { return folder / frame_path(frames); }
  /// Where this fails nothing of the frame stays.
  template <class Step>
  void with_frame(Step&& step) {
    try {
      step(*frame);
    } catch (...) {
      frame.reset();
      throw;
    }
  }
  void end_field() const {
    if (!frame->rows) return;
    const XdmfField& field = frame->fields.back();
    if (const std::size_t wanted = points * static_cast<std::size_t>(field.width); frame->values != wanted)
      throw RunError(fmt::format("{}: field '{}' has {} values; {} points of width {} need {}", next_file().string(), field.name,
                                 frame->values, points, field.width, wanted));
  }

  std::string frame_path(std::int64_t index) const { return fmt::format("frames/{}.h5", frame_name(index)); }

  /// Lists a frame whose file is complete.
  void list(std::int64_t index, double time, std::span<const XdmfField> fields) {
    const std::string link = "/frames/" + frame_name(index);
    if (!results.contains(link)) results.external_link(link, frame_path(index));
    grids.resize(static_cast<std::size_t>(index));
    grids.push_back(xdmf_grid(frame_path(index), time, points, fields));
  }

  /// A frame that an earlier run wrote.
  void list_existing(std::int64_t index) {
    const hdf5::Source frame(folder / frame_path(index));
    std::vector<XdmfField> fields;
    for (const std::string& name : frame.names("/", true)) {
      const std::vector<std::size_t> shape = frame.shape(name);
      if (shape[0] != points) {
        throw InputError({(folder / frame_path(index)).string(), 0, 0}, name,
                         fmt::format("found {} points; this body has {}", shape[0], points));
      }
      fields.push_back({name, shape.size() > 1 ? static_cast<int>(shape[1]) : 1});
    }
    list(index, frame.real("/", "time"), fields);
  }

  /// The frame that is put together becomes the next one on the disk.
  void store_frame() {
    with_frame([this](Frame& complete) {
      complete.file.keep();
      // In the order in which a resumed run finds them.
      std::ranges::sort(complete.fields, {}, &XdmfField::name);
      list(frames, complete.time, complete.fields);
    });
    frame.reset();
    store_results();
    store_sidecar();
    ++frames;
  }
  void finish() {
    if (storing.valid()) storing.get();
  }

  void store_results() { store_atomically(folder / "results.h5", results.bytes()); }

  /// Last of all, because ParaView gives up on a sidecar that names a missing file.
  void store_sidecar() {
    const fs::path file = folder / "results.xdmf";
    if (grids.empty()) return remove_file(file);
    write_file_atomically(file, xdmf_document(run.title, run.perikit_version, grids));
  }
};

FrameWriter::FrameWriter(fs::path folder, const ReferenceData& reference, RunAttributes run, std::int64_t first_frame)
    : implementation_(std::make_unique<Implementation>()) {
  Implementation& self = *implementation_;
  self.folder = std::move(folder);
  self.run = std::move(run);
  self.points = reference.points;
  make_folder(self.folder);
  make_folder(self.folder / "frames");

  write_run_attributes(self.results, self.run);
  self.results.external_link("/reference", "reference.h5");
  self.results.group("/frames");
  // What stands in the file depends on when it is flushed: frame by frame, as it was the first time.
  for (self.results.bytes(); self.frames < first_frame; ++self.frames) {
    self.list_existing(self.frames);
    self.results.bytes();
  }
  // The lists lose the later frames before the files go, so that nothing ever names a missing file.
  self.store_sidecar();
  store_reference(self.folder / "reference.h5", reference, self.run);
  self.store_results();
  remove_later_frames(self.folder / "frames", first_frame);
}

FrameWriter::~FrameWriter() = default;

void FrameWriter::begin(double time, std::int64_t step) {
  Implementation& self = *implementation_;
  self.finish();
  self.frame.emplace(self.next_file());
  self.with_frame([&](Implementation::Frame& frame) {
    frame.time = time;
    frame.file.attribute("time", time);
    frame.file.attribute("step", step);
  });
}

void FrameWriter::add(const std::string& field, int width, std::span<const double> values, const std::string& unit) {
  Implementation& self = *implementation_;
  const std::string name = dataset_of(field);
  self.with_frame([&](Implementation::Frame& frame) {
    if (frame.fields.empty() || frame.fields.back().name != name) {
      self.end_field();
      frame.fields.push_back({name, width});
      frame.rows.emplace(frame.file.rows(name, self.points, width));
      if (!unit.empty()) frame.file.attribute_of(name, "unit", unit);
      frame.values = 0;
    }
    frame.values += values.size();
    if (frame.values > self.points * static_cast<std::size_t>(width)) self.end_field();
    frame.rows->append(values);
    frame.file.check();
  });
}

std::uint64_t FrameWriter::reserve(const std::string& field, int width, const std::string& unit) {
  Implementation& self = *implementation_;
  const std::string name = dataset_of(field);
  std::uint64_t first = 0;
  self.with_frame([&](Implementation::Frame& frame) {
    self.end_field();
    frame.rows.reset();
    frame.fields.push_back({name, width});
    first = frame.file.reserve(name, self.points, width);
    if (!unit.empty()) frame.file.attribute_of(name, "unit", unit);
    frame.file.check();
  });
  return first;
}

const std::filesystem::path& FrameWriter::file() const {
  return implementation_->frame->file.temporary();
}

void FrameWriter::end() {
  Implementation& self = *implementation_;
  self.with_frame([&](Implementation::Frame& frame) {
    self.end_field();
    frame.rows.reset();
  });
  if (addresses_limited()) return self.store_frame();
  self.storing = std::async(std::launch::async | std::launch::deferred, [&self] { self.store_frame(); });   // here where no thread is to be had
}

void FrameWriter::finish() { implementation_->finish(); }

void FrameWriter::write(double time, std::int64_t step, std::span<const OutputField> fields) {
  begin(time, step);
  for (const OutputField& field : fields) add(field.name, field.width, field.data, field.unit);
  end();
  finish();
}

std::int64_t FrameWriter::frames() const noexcept {
  if (implementation_->storing.valid()) implementation_->storing.wait();
  return implementation_->frames;
}

void write_file_atomically(const std::filesystem::path& file, const std::string& text) {
  store_atomically(file, std::as_bytes(std::span(text)));
}

}  // namespace perikit
