#pragma once
// Pinocchio behind a wall: its headers take a minute to compile and its flags are not ours.
#include <memory>
#include <vector>

#include "chain.hpp"

class PinocchioChain {
 public:
  explicit PinocchioChain(const std::vector<ChainLink>& chain);
  ~PinocchioChain();
  /// Accelerations, valid until the next call; in its world or its local convention.
  const double* aba(const double* q, const double* v, const double* tau, bool world);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};
