#pragma once
// A Model as Python holds it: the immutable model, and a pool of scratch spaces so that calls from
// several threads each have one and repeated calls allocate none.
#include <memory>
#include <mutex>
#include <string>

#include <nanobind/nanobind.h>

#include "linkwise/base/error.hpp"
#include "linkwise/dynamics/batch.hpp"
#include "linkwise/dynamics/composite_rigid_body.hpp"
#include "linkwise/dynamics/forward_dynamics.hpp"
#include "linkwise/exec/thread_pool.hpp"

namespace linkwise::bindings {

/// The argument `threads`: None stands for the default, which is not looked up where the work (in
/// bodies) would not pay for a second thread.
inline int threads_of(nanobind::handle asked, size_t work) {
  if (asked.is_none()) return work < 512 ? 1 : default_threads();
  const int threads = nanobind::cast<int>(asked);
  if (threads == 0)
    throw InputError("threads is 0; give a whole number of at least 1, or None for all cores");
  return checked_threads(threads);
}

struct Scratch {
  explicit Scratch(const Model& model) : batch(model), model_(&model) {}
  BatchEvaluator batch;
  const Model& model() const { return *model_; }

  void mass_matrix(const double* q, double* H) {
    if (!composite_) composite_ = std::make_unique<CompositeRigidBody>(*model_);
    composite_->mass_matrix(q, H);
  }

  /// What "auto" stands for with all options left alone, and why.
  const Choice& default_choice() {
    if (choice_.method.empty()) choice_ = choose_dynamics(*model_, {});
    return choice_;
  }
  /// Does one state have a method of its own, not that of a batch?
  bool cut() {
    if (cut_ < 0) cut_ = is_cut(*model_);
    return cut_ > 0;
  }
  DynamicsMethod& method(const std::string& name, int threads) {
    if (!method_ || method_name_ != name || method_threads_ != threads) {
      DynamicsOptions options;
      options.method = method_name_ = name;
      options.threads = method_threads_ = threads;
      method_ = make_dynamics(*model_, options);
    }
    return *method_;
  }

 private:
  const Model* model_;
  std::unique_ptr<CompositeRigidBody> composite_;
  std::unique_ptr<DynamicsMethod> method_;
  std::string method_name_;
  Choice choice_;
  int method_threads_ = 0, cut_ = -1;
};

class PyModel {
 public:
  explicit PyModel(ModelSpec spec) : model(std::make_shared<const Model>(std::move(spec))) {}
  const std::shared_ptr<const Model> model;

  /// Borrows a scratch space and gives it back at the end of its life.
  class Lease {
   public:
    explicit Lease(const PyModel& owner) : owner_(owner) {
      const std::lock_guard lock(owner.mutex_);
      if (owner.pool_.empty()) owner.pool_.push_back(std::make_unique<Scratch>(*owner.model));
      scratch_ = std::move(owner.pool_.back());
      owner.pool_.pop_back();
    }
    ~Lease() {
      const std::lock_guard lock(owner_.mutex_);
      owner_.pool_.push_back(std::move(scratch_));
    }
    Lease(const Lease&) = delete;
    Lease& operator=(const Lease&) = delete;
    Scratch& operator*() { return *scratch_; }
    Scratch* operator->() { return scratch_.get(); }

   private:
    const PyModel& owner_;
    std::unique_ptr<Scratch> scratch_;
  };

 private:
  mutable std::mutex mutex_;
  mutable std::vector<std::unique_ptr<Scratch>> pool_;
};

}  // namespace linkwise::bindings
