#pragma once
// A Model as Python holds it: the immutable model, and what evaluates it.
#include <memory>

#include <nanobind/nanobind.h>

#include "linkwise/base/error.hpp"
#include "linkwise/dynamics/evaluator.hpp"
#include "linkwise/exec/thread_pool.hpp"

namespace linkwise::bindings {

/// The argument `threads`; None stands for the default. The default is not looked up if the work
/// (in bodies) would not pay for a second thread.
inline int threads_of(nanobind::handle asked, size_t work) {
  if (asked.is_none()) return work < 512 ? 1 : default_threads();
  const int threads = nanobind::cast<int>(asked);
  if (threads == 0)
    throw InputError("threads is 0; give a whole number of at least 1, or None for all cores");
  return checked_threads(threads);
}

struct PyModel {
  explicit PyModel(ModelSpec spec)
      : model(std::make_shared<const Model>(std::move(spec))), evaluator(*model) {}

  const std::shared_ptr<const Model> model;
  const Evaluator evaluator;
};

}  // namespace linkwise::bindings
