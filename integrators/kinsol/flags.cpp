#include "flags.hpp"

#include <fmt/format.h>
#include <kinsol/kinsol.h>

namespace perikit {

std::string kinsol_flag_meaning(int flag) {
  switch (flag) {
    case KIN_STEP_LT_STPTOL: return "KINSOL's steps became too small to change the residual";
    case KIN_LINESEARCH_NONCONV: return "KINSOL's line search found no lower residual";
    case KIN_MAXITER_REACHED: return "KINSOL reached max_iterations";
    case KIN_MXNEWT_5X_EXCEEDED: return "five steps of KINSOL had the largest length allowed: the residual has no zero nearby";
    case KIN_LINESEARCH_BCFAIL: return "KINSOL's line search could not meet its curvature condition";
    case KIN_LINSOLV_NO_RECOVERY: return "the linear solver did not converge";
    case KIN_LINIT_FAIL: return "the linear solver could not be initialised";
    case KIN_LSETUP_FAIL: return "the linear solver could not be set up";
    case KIN_LSOLVE_FAIL: return "the linear solver failed";
    case KIN_SYSFUNC_FAIL: return "the forces could not be evaluated";
    case KIN_FIRST_SYSFUNC_ERR: return "the start of the step is inadmissible";
    case KIN_REPTD_SYSFUNC_ERR: return "KINSOL met inadmissible deformations again and again";
    case KIN_MEM_FAIL: return "KINSOL is out of memory";
    case KIN_VECTOROP_ERR: return "a vector operation of KINSOL failed";
    default: return fmt::format("KINSOL ended with flag {}", flag);
  }
}

}  // namespace perikit
