#pragma once
// What is timed: a method of one engine on one machine.
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

struct Contestant {
  std::string method;
  int systems;  // that one call evaluates
  int threads;
  bool loads;  // whether a call finds the joint loads too
  int acceleration_count;
  /// Evaluates state k (or all of them, when systems > 1); returns the accelerations, valid until
  /// the next call. Throws when the method fails.
  std::function<const double*(int k)> evaluate;
};

struct Field {
  int states = 0;
  std::vector<Contestant> contestants;
};

Field make_linkwise(const std::filesystem::path& folder);
Field make_pinocchio(const std::filesystem::path& folder);
Field make_mujoco(const std::filesystem::path& folder);
