#include "scene/sections.hpp"

#include "output_fields/point_field.hpp"
#include "output_fields/state_field.hpp"
#include "perikit/core/warnings.hpp"
#include "scene/scene.hpp"

namespace perikit {

namespace {

constexpr auto unbounded = std::numeric_limits<std::size_t>::max();

std::vector<std::string> faces() { return {"+x", "-x", "+y", "-y", "+z", "-z"}; }

}  // namespace

ParameterTable head_parameters() {
  ParameterTable table;
  table.integer("format", "Version of the scene vocabulary.").require().at_least(1).at_most(1);
  table.string("title", "Written into the results.").by_default("\"\"");
  table.add(ParameterType::texts, "plugins", "-", "Extra libraries, relative to the scene file; opened only with --trust.")
      .by_default("[]");
  return table;
}

ParameterTable model_parameters() {
  ParameterTable table;
  table.part("kinematics", Kind::kinematics, "How displacements give deformation gradients.").require();
  table.part("material", Kind::material, "The point law of the body.").require();
  table.part("damage", Kind::damage, "When bonds fail.");
  table.part("integrator", Kind::integrator, "How the problem is solved in time or load.").require();
  return table;
}

ParameterTable body_parameters(int dimension) {
  ParameterTable table;
  table.integer("dimension", "Spatial dimension of the body.").require().at_least(1).at_most(3);
  const bool all = dimension == 0;
  if (all || dimension == 2) {
    Parameter& plane = table.choice("plane", {"strain", "stress"}, "2D, where it is required: plane strain or plane stress.");
    plane.required = !all;
    table.number("thickness", "m", "2D: thickness of the body.").positive().by_default("1.0");
  }
  if (all || dimension == 1) {
    table.choice("line", {"stress", "strain"}, "1D: uniaxial stress or uniaxial strain.").by_default("\"stress\"");
    table.number("area", "m^2", "1D: cross section of the body.").positive().by_default("1.0");
  }
  return table;
}

ParameterTable lattice_parameters() {
  ParameterTable table;
  table.number("spacing", "m", "Distance of neighbouring points.").require().positive();
  table.add(ParameterType::numbers, "lower", "m", "Lower corner; the first point lies half a spacing inside.")
      .require()
      .one_per_axis();
  table.add(ParameterType::numbers, "upper", "m", "Upper corner.").require().one_per_axis();
  table.expression("inside", "-", "Points are kept where this is true.");
  table.number("jitter", "-", "Random shift of the points, as a fraction of the spacing.")
      .at_least(0)
      .at_most(0.5)
      .by_default("0.0");
  table.integer("seed", "Seed of the random shift; default: run.seed.").at_least(0);
  table
      .choice("volume", {"cell", "voronoi"},
              "Volumes of points: of their lattice cells, or of their Voronoi cells, clipped by the box and `inside`.")
      .by_default("\"cell\"");
  return table;
}

ParameterTable points_parameters() {
  ParameterTable table;
  table.string("file", "A .csv with the header x,y,z,volume, or an .h5 with datasets of these names; relative to the scene file.")
      .require();
  table
      .choice("volume", {"file", "voronoi"},
              "Volumes of points: those of the file, or of their Voronoi cells; the file need not have any then.")
      .by_default("\"file\"");
  table
      .add(ParameterType::numbers, "lower", "m",
           "With volume = \"voronoi\": lower corner of the box that clips the cells; without it half a spacing below the points.")
      .one_per_axis();
  table.add(ParameterType::numbers, "upper", "m", "Upper corner, likewise.").one_per_axis();
  table.expression("inside", "-", "With volume = \"voronoi\": cells are clipped to where this is true.");
  return table;
}

ParameterTable set_parameters() {
  ParameterTable table;
  table.add(ParameterType::numbers, "nearest", "m", "The point nearest to this position.").one_per_axis();
  table.add(ParameterType::integers, "points", "-", "Indices of points in input order, from 0.").at_least(0).length(1, unbounded);
  table.exactly(1, {"nearest", "points"});
  return table;
}

ParameterTable family_parameters() {
  ParameterTable table;
  table.number("horizon_ratio", "-", "Horizon over the spacing of the points.").at_least(1);
  table.number("horizon", "m", "Horizon as a length.").positive();
  table.part("influence", Kind::influence, "Influence function.").by_default("\"constant\"");
  table.boolean("partial_volume", "Lattices: points of cells that `inside` cuts stand for what of these lies inside, at its centroid.")
      .by_default("false");
  table.boolean(
      "consistent",
      "Clouds: weights of evaluation points, or point gradients, with which a constant stress is in equilibrium inside of the body, as on a "
      "lattice. true unless given for [body.points] and lattices with jitter, where the kinematics allow it.");
  // No default that would be written out: it is refused where there is nothing to choose.
  table.choice("interfaces", {"laminate", "parallel"},
               "Evaluation points that two materials share: a laminate of both (the default), or each law "
               "with its share of the weight.");
  table.exactly(1, {"horizon_ratio", "horizon"});
  return table;
}

ParameterTable region_parameters() {
  ParameterTable table;
  table.string("set", "The points that have another material.").require();
  table.part("material", Kind::material, "Their point law.").require();
  return table;
}

ParameterTable interface_parameters() {
  ParameterTable table;
  table
      .add(ParameterType::texts, "between", "-",
           "The two regions, by the names of their sets; \"rest\": what belongs to no region.")
      .require()
      .length(2, 2);
  table.part("damage", Kind::damage, "Limits of the bonds between them: the criterion of [damage] with other numbers.").require();
  return table;
}

ParameterTable crack_parameters() {
  ParameterTable table;
  table.add(ParameterType::points, "segment", "m", "2D: the two ends of the crack.").length(2, 2).one_per_axis();
  table.add(ParameterType::points, "polygon", "m", "3D: the corners of a plane crack, in order.")
      .length(3, unbounded)
      .one_per_axis();
  table.exactly(1, {"segment", "polygon"});
  return table;
}

ParameterTable initial_parameters() {
  ParameterTable table;
  table.add(ParameterType::expressions, "displacement", "m", "Displacement at the start.").one_per_axis();
  table.add(ParameterType::expressions, "velocity", "m/s", "Velocity at the start.").one_per_axis();
  table.string("from", "Start from the last frame of these results (results.h5), relative to the scene file.");
  table.at_most_of(1, {"from", "displacement"}).at_most_of(1, {"from", "velocity"});
  return table;
}

void add_ramp(ParameterTable& table) {
  table.boolean("ramp",
                "In quasi-static runs: whether values grow in proportion to the load parameter t. Without it those do that do "
                "not mention t. false: they act as "
                "they are from the start; true: only of values without t.");
}

ParameterTable boundary_parameters() {
  ParameterTable table;
  table.string("set", "The points whose motion is prescribed; with `face` those whose side it is, default: all. Needed without `face`.");
  table.choice("face", faces(), "Prescribe the motion of this side of the set instead of that of its points.");
  table.number("at", "m", "With `face`: where it lies. Without it half a spacing beyond the outermost points; points from a file say by their volumes, or the box of their cells, whether they lie on it.");
  table.expression("surface", "-", "Prescribe the motion of the surface where this expression of x, y, z is zero; it is negative in the body, a cloud.");
  table.add(ParameterType::components, "displacement", "m", "Prescribed displacement.").with_time();
  table.add(ParameterType::components, "velocity", "m/s", "Prescribed velocity.").with_time();
  add_ramp(table);
  table.exactly(1, {"displacement", "velocity"});
  return table;
}

ParameterTable symmetry_parameters() {
  ParameterTable table;
  table.choice("axis", {"x", "y", "z"}, "Normal of the plane, of which the body is one half.").require();
  table.number("at", "m", "Where the plane lies. Without it half a spacing below the lowest points; points from a file say by their volumes, or the box of their cells, whether they lie on it.");
  return table;
}

ParameterTable periodic_parameters() {
  ParameterTable table;
  table.choice("axis", {"x", "y", "z"}, "Along which the body continues with itself.").require();
  table.number("lower", "m", "Where the body begins; without it half a spacing below the lowest points. Needed where points come from a file.");
  table.number("upper", "m", "Where it ends and begins again, likewise.");
  return table;
}

ParameterTable load_parameters() {
  ParameterTable table;
  table.string("set", "The points that are loaded.").require();
  table.add(ParameterType::expressions, "force", "N", "Total force on the set, shared by volume.").with_time().one_per_axis();
  table.add(ParameterType::expressions, "body_force", "N/m^3", "Force per volume.").with_time().one_per_axis();
  table.add(ParameterType::expressions, "traction", "Pa", "Force per area on `face`.").with_time().one_per_axis();
  table.expression("pressure", "Pa", "Force per area against the outward normal of the free surface of the set.").with_time();
  table.choice("face", faces(),
               "With traction: the side of the set that carries it. With pressure: the one side that carries it, instead of all "
               "of the surface.");
  table.boolean("follower", "With pressure: normal and area are those of the deformed surface.").by_default("false");
  add_ramp(table);
  table.exactly(1, {"force", "body_force", "traction", "pressure"});
  return table;
}

ParameterTable output_parameters() {
  ParameterTable table;
  table.integer("frames", "Number of frames, evenly spaced in time.").at_least(1).by_default("20");
  table.integer("every", "A frame every so many steps.").at_least(1);
  table.add(ParameterType::numbers, "times", "s", "A frame at the first step at or after each of these times, ascending.")
      .at_least(0)
      .length(1, unbounded);
  table.integer("history_every", "Steps between samples; 0: as the integrator suggests.").at_least(0).by_default("0");
  table.integer("checkpoint_every", "Steps between checkpoints; 0: none.").at_least(0).by_default("0");
  Parameter& fields = table.add(ParameterType::texts, "fields", "-",
                                "Point fields of the frames; without it displacement, velocity (dynamic runs), strain_energy_density and damage (if "
                                "any). state:NAME: what a material of the scene remembers (`perikit describe`).");
  fields.length(1, unbounded).choices = point_field_names();
  fields.choice_prefix = state_prefix;
  table.at_most_of(1, {"frames", "every", "times"});
  return table;
}

ParameterTable history_parameters() {
  ParameterTable table;
  table.string("name", "Name of the column.").require();
  table.string("set", "The points that are sampled.").by_default("\"all\"");
  table.choice("quantity", point_field_names(), "A point field.").choice_prefix = state_prefix;
  table.string("value", "In place of a quantity: an expression of other columns of the same row, of t and of [constants], such as \"stress/strain\".");
  table.string("component", "Component of a vector (x) or tensor (xy); with reduce = \"moment\" of the moment, in 2D z, which may be left out.");
  table
      .choice("reduce", {"mean", "sum", "min", "max", "fit", "error", "moment", "extent", "tip", "area", "mass"},
              "How the values of the set become one. fit: an affine function fitted to them, taken at the place `at`; error: their "
              "root-mean-square distance from `exact`, relative to that of `exact` from 0, weighted by volume; moment: of forces about the point "
              "`about` [N m]; extent: how far the points with a value above `above` extend along `direction` [m]; tip: the place of the outermost of "
              "them along `direction` [m]; area: of damage, the area of the cracks of the run [m^2]; mass: of fragment, the mass of the piece `piece` [kg].")
      .by_default("\"mean\"");
  table.add(ParameterType::numbers, "at", "m", "With reduce = \"fit\": a place, which need not be a point of the body.").one_per_axis();
  table.add(ParameterType::expression, "exact", "-", "With reduce = \"error\": what the quantity should be, in its own unit.").with_time();
  table.add(ParameterType::numbers, "about", "m", "With reduce = \"moment\": a fixed place. Lever arms reach from it to the points where they are.").one_per_axis();
  table.add(ParameterType::numbers, "direction", "-", "With reduce = \"extent\" or \"tip\": along which is measured, from the origin, where the points were.").one_per_axis();
  table.number("above", "-", "With reduce = \"extent\" or \"tip\": points count where the quantity is above this, in its own unit.");
  table.integer("piece", "With reduce = \"mass\": number of the piece, 1 for the biggest.").at_least(1);
  table.exactly(1, {"quantity", "value"});
  return table;
}

ParameterTable derived_column_parameters() {
  const ParameterTable all = history_parameters();
  ParameterTable table;
  for (const char* key : {"name", "value"}) table.add(ParameterType::text, key, "-", "") = *all.find(key);
  return table;
}

ParameterTable run_parameters() {
  ParameterTable table;
  table.boolean("skip", "Leave out work whose result is known: checks of bonds that cannot have failed, parts of the body that no wave has reached. "
                        "false only to compare: the result is the same, bit for bit.").by_default("true");
  table.boolean("share", "Compute what is equal once: bonds for both of their ends, stencils for equal families. false only to compare: the "
                         "result is the same to rounding.").by_default("true");
  table.integer("threads", "Number of threads; without it as many as the machine has.").at_least(1).at_most(4096);
  table.number("weak_springs", "-", "Quasi-static runs: pieces of the body that nothing holds hang on springs of this share of a point's stiffness, where they are. "
                                    "Without it such a piece is refused.").positive().at_most(1.0);
  table.add(ParameterType::texts, "silence", "-", "Kinds of warnings that are not told: the name in brackets at the end of a warning (refusals.md has all).")
      .by_default("[]")
      .choices.assign(warning_kinds.begin(), warning_kinds.end());
  table.integer("seed", "Seed of what is random in the run, the shift of jittered points, where body.lattice has none of its own.").at_least(0).by_default("1");
  return table;
}

ParameterTable common_part_parameters(Kind kind) {
  ParameterTable table;
  if (kind == Kind::kinematics) table.part("stabilization", Kind::stabilization, "Against zero-energy modes.");
  if (kind == Kind::term) table.string("set", "The points that it acts on.").by_default("\"all\"");
  if (kind == Kind::damage) {
    table.add(ParameterType::texts, "no_fail", "-", "Sets of points whose bonds never fail.").by_default("[]");
    table.boolean("gradual", "Explicit runs: a bond that fails lets go in the time that a Rayleigh wave needs along it, not at once.").by_default("false");
    table.boolean("second_law",
                  "Bonds whose failure would raise the stored energy stay until it does not. Without it true where the "
                  "kinematics creates energy as bonds "
                  "fail: one gradient per point without a stabilization, order = 2 and more, bond_augmented, sub_horizon, selective over "
                  "weighted bond gradients.");
  }
  return table;
}

const std::vector<std::pair<std::string, ParameterTable>>& scene_sections() {
  static const std::vector<std::pair<std::string, ParameterTable>> sections = [] {
    ParameterTable top = head_parameters();
    const ParameterTable model = model_parameters();
    for (const Parameter& part : model.parameters()) top.add(part.type, part.name, part.unit, part.text) = part;
    return std::vector<std::pair<std::string, ParameterTable>>{{"", top},
                                                               {"sets", set_parameters()},
                                                               {"constants", {}},
                                                               {"body", body_parameters(0)},
                                                               {"body.lattice", lattice_parameters()},
                                                               {"body.points", points_parameters()},
                                                               {"family", family_parameters()},
                                                               {"kinematics", common_part_parameters(Kind::kinematics)},
                                                               {"region", region_parameters()},
                                                               {"damage", common_part_parameters(Kind::damage)},
                                                               {"interface", interface_parameters()},
                                                               {"crack", crack_parameters()},
                                                               {"initial", initial_parameters()},
                                                               {"boundary", boundary_parameters()},
                                                               {"symmetry", symmetry_parameters()},
                                                               {"periodic", periodic_parameters()},
                                                               {"load", load_parameters()},
                                                               {"term", common_part_parameters(Kind::term)},
                                                               {"output", output_parameters()},
                                                               {"output.history", history_parameters()},
                                                               {"run", run_parameters()}};
  }();
  return sections;
}

}  // namespace perikit
