#pragma once
// Makes an elastic body of a rigid link of a spec: a row of beams, each welded to the end of the
// one before, from the link's frame to the point where its outboard joints are, or one modal body.
#include <optional>
#include <string>
#include <unordered_map>
#include <unordered_set>
#include <vector>

#include "linkwise/model/spec.hpp"

namespace linkwise {

struct FlexibleLink {
  std::string link;
  double E, G;                    ///< moduli, Pa
  double area, Iy, Iz, J;         ///< of the section, m2 and m4; y and z are the beam's axes
  double width = 0, height = 0;   ///< of the section's outside along y and z, m; 0: not known
  bool round = false;             ///< the outside is a circle
  std::optional<double> density;  ///< kg/m3; else the link's mass is spread over its length
  double damping = 0;             ///< ratio of every mode
  int bodies = 1, interior_modes = 2;
  bool stretches = true;
  std::optional<Vec3<double>> end;  ///< in the link's frame, m; else where its joints are
  std::optional<Vec3<double>> z;    ///< near the beam's z axis, in the link's frame; else its z
};

/// A link that is a modal body (bodies/modal.hpp).
struct ModalLink {
  std::string link;
  std::vector<double> parameters;
};

/// Makes links of a spec flexible, one after the other; what hangs on which link is known.
class FlexibleLinks {
 public:
  explicit FlexibleLinks(ModelSpec& spec);

  /// The link of this name becomes the first beam; the others are links `NAME:2`, `NAME:3` ..., and
  /// `NAME:end` is a link without mass at the last one's end, which carries what the link carried.
  /// Elastic joints `NAME:1` ... join them. Throws InputError where the link is not there, is
  /// flexible already, its joints are at several points, or a number is wrong.
  void add(const FlexibleLink& flexible);
  /// `NAME:end` and the elastic joint `NAME:1` as above. A body without a port carries no joints.
  /// Throws InputError likewise, and where the link's joints are not at the body's port.
  void add(const ModalLink& flexible);

  /// Joints whose parent a link is, and joints that close loops on it: their places in the spec.
  struct Attached {
    std::vector<int> joints, loops;
  };

 private:
  LinkSpec& rigid_link(const std::string& name, const std::string& head);
  void put(const JointSpec& joint, LinkSpec link);

  ModelSpec& spec_;
  std::unordered_map<std::string, size_t> link_;
  std::unordered_map<std::string, Attached> attached_;
  std::unordered_set<std::string> moved_;  ///< links that are children of joints
};

/// Of one link: FlexibleLinks::add.
template <class Flexible>
ModelSpec with_flexible_link(ModelSpec spec, const Flexible& flexible) {
  FlexibleLinks(spec).add(flexible);
  return spec;
}

}  // namespace linkwise
