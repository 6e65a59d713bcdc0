#include "ranks.hpp"

#include <fmt/format.h>
#include <sched.h>
#include <unistd.h>

#include <algorithm>
#include <cstdlib>
#include <vector>

#include "core/ranks/serial_communicator.hpp"
#include "output_fields/point_fields.hpp"
#include "peak_memory.hpp"
#include "perikit/core/communicator.hpp"
#include "perikit/core/warnings.hpp"
#include "run/simulation.hpp"
#include "setup/body/body.hpp"

namespace perikit::app {

namespace {

/// Makes the fields of a frame after one step, and ends the run.
class FrameAfterStep final : public Observer {
 public:
  explicit FrameAfterStep(Simulation& simulation) : simulation_(simulation) {}
  void make() {
    std::vector<std::string> names = simulation_.scene().output.fields;
    if (names.empty()) names = {"displacement", simulation_.dynamic() ? "velocity" : "displacement", "strain_energy_density"};
    PointFields fields(simulation_.problem(), simulation_.dynamic(), false);
    fields.expect(names);
    for (const std::string& name : names) {
      fields.get(name);
      fields.forget(name);
    }
  }
  bool wants_sample(std::int64_t, double) override { return true; }
  void step_done(const StepReport& report) override {
    done_ = report.step > 0;
    make();
  }
  void log(std::string_view) override {}
  bool cancelled() const noexcept override { return done_; }

 private:
  Simulation& simulation_;
  bool done_ = false;
};

struct Share {
  double points = 0, near = 0, ghosts = 0, bytes = 0, peak = 0, of_all = 0;
  bool cloud = false;
};

Share share_of(const Scene& scene, const Registry& registry, int rank, int ranks) {
  LoneRank alone(rank, ranks);
  const CommunicatorScope scope(alone);
  PeakMemory peak;
  // A rank without others places its part in another way, which takes other memory.
  Simulation simulation(scene, registry, [&](const std::string& step) {
    if (step == "laws") peak.forget();
  });
  try_step(simulation);
  const Body& body = simulation.problem().body();
  Share share{static_cast<double>(body.owned().size()),
              0,
              0,
              static_cast<double>(simulation.problem().bytes()),
              peak.bytes(),
              static_cast<double>(body.points_of_all_ranks()),
              body.lattice() == nullptr};
  if (rank == 0 && share.peak > 0) share.peak += RunRecorder::bytes_of_pieces(body.points_of_all_ranks());
  share.ghosts = static_cast<double>(body.points()) - share.points;
  const std::size_t materials = scene.regions.size() + 1;  // far points have one more
  for (const std::int32_t p : body.internal())
    share.near += !body.owns(static_cast<std::size_t>(p)) && body.material_ids()[static_cast<std::size_t>(p)] < materials;
  return share;
}

int ranks_of_node() {
  for (const char* variable : {"OMPI_COMM_WORLD_LOCAL_SIZE", "MPI_LOCALNRANKS", "SLURM_NTASKS_PER_NODE"})
    if (const char* text = std::getenv(variable)) return std::max(1, std::atoi(text));
  return std::max(1, communicator().size());
}

}  // namespace

int cores_of_rank() {
  cpu_set_t set;
  CPU_ZERO(&set);
  const int all = std::max(1, static_cast<int>(sysconf(_SC_NPROCESSORS_ONLN)));
  const int bound = sched_getaffinity(0, sizeof set, &set) == 0 ? CPU_COUNT(&set) : all;
  return bound < all ? bound : std::max(1, bound / ranks_of_node());
}

std::string crowded(int threads) {
  const int cores = cores_of_rank();
  if (threads <= cores) return {};
  return named("threads", fmt::format(
      "warning: each rank has {} threads on {} core{}; allowed: --threads {}, or mpirun --map-by slot:PE={}, or --bind-to none "
      "where cores are free",
      threads, cores, cores == 1 ? "" : "s", cores, threads));
}

void try_step(Simulation& simulation) {
  try {
    FrameAfterStep frame(simulation);
    simulation.dynamic() ? simulation.run(frame) : frame.make();
  } catch (const std::exception&) {
    // A run says what is wrong, and a part alone has other forces than it has among others.
  }
}

std::string predict_ranks(const Scene& scene, const Registry& registry, int ranks, bool heaviest_alone) {
  std::vector<Share> shares;
  if (heaviest_alone)
    shares.push_back(share_of(scene, registry, heaviest_rank(scene, ranks), ranks));
  else
    for (int rank = 0; rank < ranks; ++rank) shares.push_back(share_of(scene, registry, rank, ranks));
  const auto most = [&](auto&& value) { return std::ranges::max(shares, {}, value); };
  double exchanged = 0;
  for (const Share& share : shares) exchanged += share.ghosts;
  const double points = shares.front().of_all, mean = points / ranks;
  const Share largest = most(&Share::points), deepest = most(&Share::ghosts), heaviest = most(&Share::bytes),
              busiest = most([](const Share&share) { return share.points + share.near; });
  const std::string by_all =
      heaviest_alone ? std::string() : fmt::format(", {:.3g} MB by all", 8e-6 * scene.body.dimension * exchanged);
  const double peak = most(&Share::peak).peak;
  const std::string in_all = peak > 0 ? fmt::format(", about {:.3g} MB a process at most", peak / 1e6) : std::string();
  const std::string parts =
      heaviest_alone
          ? fmt::format(
                "points        {:.0f}, more than one rank here can hold; each rank places its own part, of which {}\n", points,
                largest.cloud ? "one in the middle of the curve was set up; others have as many points, and about as many ghosts"
                              : "the largest was set up")
          : std::string();
  return parts + fmt::format(
                     "ranks         {}\n"
                     "balance       {:.0f} points on the largest rank, {:.3f} of the mean\n"
                     "ghosts        at most {:.0f} points a rank, {:.2f} of the mean number of its own\n"
                     "exchange      at most {:.3g} MB a rank and step{}\n"
                     "work          {:.0f} points evaluated on the busiest rank: {:.2f} of the speed of {} ranks without ghosts, "
                     "at best\n"
                     "memory        at most {:.3g} MB of arrays of its part on a rank{}\n",
                     ranks, largest.points, largest.points / mean, deepest.ghosts, deepest.ghosts / mean,
                     8e-6 * scene.body.dimension * deepest.ghosts, by_all, busiest.points + busiest.near,
                     mean / (busiest.points + busiest.near), ranks, heaviest.bytes / 1e6, in_all);
}

}  // namespace perikit::app
