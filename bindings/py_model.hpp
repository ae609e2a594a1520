#pragma once
// A Model as Python holds it: the immutable model, and what evaluates it.
#include <memory>

#include <nanobind/nanobind.h>

#include "linkwise/dynamics/evaluator.hpp"
#include "linkwise/exec/executor.hpp"

namespace linkwise::bindings {

struct PyModel {
  explicit PyModel(ModelSpec spec)
      : model(std::make_shared<const Model>(std::move(spec))), evaluator(*model) {}

  const std::shared_ptr<const Model> model;
  const Evaluator evaluator;
};

}  // namespace linkwise::bindings
