#include "field_vector.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

#include "perikit/core/communicator.hpp"
#include "perikit/core/field_operations.hpp"

namespace perikit {

namespace {

struct Content {
  const Problem* problem;
  Field owned;
  FieldView view;
};

Content& content(N_Vector v) { return *static_cast<Content*>(v->content); }
double* data(N_Vector v) { return content(v).view.data; }
std::size_t size(N_Vector v) { return content(v).view.size(); }

/// z[k] <- value(k) for all k.
template <class Value>
void assign(N_Vector z, Value&& value) {
  double* to = data(z);
  over_blocks(size(z), [&](std::size_t begin, std::size_t end) {
    for (std::size_t k = begin; k < end; ++k) to[k] = value(k);
  });
}

/// Exact, over all ranks.
template <class Value>
double sum(N_Vector x, Value&& value) {
  return total_over_ranks(exact_sum(size(x), value));
}

/// The smallest value on all ranks.
template <class Value>
double least(N_Vector x, double start, Value&& value) {
  constexpr std::size_t block = 16384;
  const std::size_t n = size(x);
  std::vector<double> parts((n + block - 1) / block, start);
  parallel_for(parts.size(), [&](std::size_t b) {
    for (std::size_t k = b * block; k < std::min(n, (b + 1) * block); ++k) parts[b] = std::min(parts[b], value(k));
  });
  for (const double part : parts) start = std::min(start, part);
  return -communicator().largest(-start);
}

N_Vector clone_of(N_Vector w, bool with_memory) {
  N_Vector v = N_VNewEmpty(w->sunctx);
  if (!v) return nullptr;
  N_VCopyOps(w, v);
  const Content& from = content(w);
  auto* own = new Content{from.problem, {}, {}};
  if (with_memory) {
    own->owned = from.problem->points().make_field(from.view.components);
    own->view = own->owned;
  }
  v->content = own;
  return v;
}

void destroy(N_Vector v) {
  if (!v) return;
  delete static_cast<Content*>(v->content);
  v->content = nullptr;
  N_VFreeEmpty(v);
}

void set_operations(N_Vector v) {
  N_Vector_Ops ops = v->ops;
  // SUNLinSol_KLU takes shared-memory vectors by their names; this is one: an array that one process works on with threads.
  ops->nvgetvectorid = [](N_Vector) { return SUNDIALS_NVEC_OPENMP; };
  ops->nvclone = [](N_Vector w) { return clone_of(w, true); };
  ops->nvcloneempty = [](N_Vector w) { return clone_of(w, false); };
  ops->nvdestroy = destroy;
  ops->nvgetarraypointer = data;
  ops->nvgetlength = [](N_Vector w) { return static_cast<sunindextype>(size(w)); };
  ops->nvspace = [](N_Vector w, sunindextype* reals, sunindextype* integers) {
    *reals = static_cast<sunindextype>(size(w));
    *integers = 1;
  };
  ops->nvlinearsum = [](realtype a, N_Vector x, realtype b, N_Vector y, N_Vector z) {
    combine(a, content(x).view, b, content(y).view, content(z).view);
  };
  ops->nvconst = [](realtype c, N_Vector z) { fill(c, content(z).view); };
  ops->nvprod = [](N_Vector x, N_Vector y, N_Vector z) { assign(z, [a = data(x), b = data(y)](std::size_t k) { return a[k] * b[k]; }); };
  ops->nvdiv = [](N_Vector x, N_Vector y, N_Vector z) { assign(z, [a = data(x), b = data(y)](std::size_t k) { return a[k] / b[k]; }); };
  ops->nvscale = [](realtype c, N_Vector x, N_Vector z) { assign(z, [c, a = data(x)](std::size_t k) { return c * a[k]; }); };
  ops->nvabs = [](N_Vector x, N_Vector z) { assign(z, [a = data(x)](std::size_t k) { return std::abs(a[k]); }); };
  ops->nvinv = [](N_Vector x, N_Vector z) { assign(z, [a = data(x)](std::size_t k) { return 1 / a[k]; }); };
  ops->nvaddconst = [](N_Vector x, realtype c, N_Vector z) { assign(z, [c, a = data(x)](std::size_t k) { return a[k] + c; }); };
  ops->nvdotprod = [](N_Vector x, N_Vector y) { return dot(content(x).view, content(y).view); };
  ops->nvmaxnorm = [](N_Vector x) { return largest_magnitude(content(x).view); };
  ops->nvmin = [](N_Vector x) { return least(x, data(x)[0], [a = data(x)](std::size_t k) { return a[k]; }); };
  ops->nvl1norm = [](N_Vector x) { return sum(x, [a = data(x)](std::size_t k) { return std::abs(a[k]); }); };
  ops->nvwl2norm = [](N_Vector x, N_Vector w) {
    return std::sqrt(sum(x, [a = data(x), b = data(w)](std::size_t k) { return a[k] * b[k] * a[k] * b[k]; }));
  };
  ops->nvwrmsnorm = [](N_Vector x, N_Vector w) { return N_VWL2Norm(x, w) / std::sqrt(static_cast<double>(size(x))); };
}

}  // namespace

SundialsContext::SundialsContext() {
  if (SUNContext_Create(nullptr, &context_) != 0) throw RunError("SUNDIALS gives no context");
}

SundialsContext::~SundialsContext() { SUNContext_Free(&context_); }

FieldVector wrap(const Problem& problem, FieldView view, SUNContext context) {
  FieldVector v(N_VNewEmpty(context));
  if (!v) throw RunError("SUNDIALS gives no vector");
  v->content = new Content{&problem, {}, view};
  set_operations(v.get());
  return v;
}

FieldView field_of(N_Vector v) { return content(v).view; }

}  // namespace perikit
