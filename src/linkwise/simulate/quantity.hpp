#pragma once
// What a simulation records: one table from which the samples are written, and from which Python
// takes names, shapes, units and texts.
#include <array>
#include <cstdint>
#include <span>
#include <string_view>

#include "linkwise/integrate/integrator.hpp"
#include "linkwise/model/model.hpp"

namespace linkwise {

class LoopForces;

struct SimulationStatistics : IntegratorStatistics {
  long iterations = 0;
  /// Largest error that a solution for the integrator can have had, as Report has it; infinity
  /// where one was not bounded. 0 of direct solvers.
  double solver_error = 0.0;
};

/// One member at one time, as the writers of the table see it.
struct Instant {
  const Model& model;
  const double *q, *v;
  const double *du, *joint_load, *drive_torque;
  const double* external;  ///< null: nothing acts
  const double* work;      ///< of a WorkIntegral; null: not known
  const SimulationStatistics& statistics;
  const LoopForces* loops = nullptr;      ///< null: no joint closes a loop
  const double* coupling_load = nullptr;  ///< [terms of couplings]
};

/// The columns of a quantity: one per coordinate [nq], rate [nv], coordinate or rate of a joint
/// that closes a loop, term of a coupling, joint [n_loads][6] or body that a joint carries
/// [n_joints][6], or a single one [1].
enum class Axis { coordinates, rates, loop_coordinates, loop_rates, terms, joints, bodies, none };
std::string_view to_string(Axis axis);

/// What has to be computed before it can be written.
enum class Needs { state, works, forces, loads };

struct QuantityEntry {
  std::string_view name;
  std::string_view group;  ///< the name by which users ask for it
  Axis axis;
  Needs needs;
  bool of_members;  ///< also recorded where many simulations run at once
  /// Per rate and coordinate: what follows the unit of the coordinate, or "force" or
  /// "energy"; else the unit.
  std::string_view units;
  std::string_view long_name, frame, point, convention;
  void (*write)(const Instant&, double*);  ///< or null, where it is a whole number:
  long (*count)(const Instant&);
};

/// In the order in which data sets list them.
std::span<const QuantityEntry> quantity_table();
/// Its place in the table; InputError where there is none of that name.
size_t quantity_index(std::string_view name);
/// Numbers per member and time.
size_t quantity_width(const QuantityEntry& entry, const Model& model);

/// Where samples go, by place in the table; null pointers are not computed. Rows of one member are
/// next to each other.
struct Sample {
  static constexpr size_t size = 24;  ///< at least that of the table
  std::array<double*, size> values{};
  std::array<std::int64_t*, size> counts{};
  size_t rows = 1;  ///< from one member to the next

  /// By name, such as sample["position"].
  double*& operator[](std::string_view name) { return values[quantity_index(name)]; }

  bool needs(Needs needs) const;
  /// The same arrays from row `row` of member `member` on.
  Sample at(const Model& model, size_t member, size_t row) const;
  /// One row of one member; NaN, or -1 where whole numbers are counted, where it has ended.
  void write(const Model& model, size_t member, const Instant* instant) const;
  /// The first quantity in a member's row that is no number; empty where all are. Works that are
  /// not known are NaN, and nothing is wrong with that.
  std::string_view not_finite(const Model& model, size_t member, bool works_are_known) const;
};

}  // namespace linkwise
