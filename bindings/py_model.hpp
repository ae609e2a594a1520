#pragma once
// A Model as Python holds it: the immutable model, and a pool of scratch spaces so that calls from
// several threads each have one and repeated calls allocate none.
#include <map>
#include <memory>
#include <mutex>

#include "linkwise/dynamics/batch.hpp"
#include "linkwise/dynamics/composite_rigid_body.hpp"
#include "linkwise/dynamics/forward_dynamics.hpp"

namespace linkwise::bindings {

struct Scratch {
  explicit Scratch(const Model& model) : batch(model) {}
  BatchEvaluator batch;
  std::unique_ptr<CompositeRigidBody> composite;
  std::map<std::pair<std::string, std::string>, std::unique_ptr<DynamicsMethod>>
      methods;  ///< default options
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
