#pragma once
/// The tables of the scene's own sections.

#include "perikit/plugin/parameters.hpp"

namespace perikit {

ParameterTable head_parameters();               ///< format, title, plugins
ParameterTable model_parameters();              ///< the parts at the top level
ParameterTable body_parameters(int dimension);  ///< keys that fit the dimension; 0: all
ParameterTable lattice_parameters();
ParameterTable points_parameters();
ParameterTable set_parameters();
ParameterTable family_parameters();
ParameterTable region_parameters();
ParameterTable interface_parameters();
ParameterTable crack_parameters();
ParameterTable initial_parameters();
ParameterTable boundary_parameters();
ParameterTable symmetry_parameters();
ParameterTable periodic_parameters();
ParameterTable load_parameters();
ParameterTable output_parameters();
ParameterTable history_parameters();
/// Those of a column with a value from other columns.
ParameterTable derived_column_parameters();
ParameterTable run_parameters();

/// Keys that the framework adds to every part of a kind at the top level: stabilization, no_fail, gradual.
ParameterTable common_part_parameters(Kind kind);

}  // namespace perikit
