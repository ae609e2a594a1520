#pragma once
// A machine as the user gave it: links, and joints as directed edges from parent to child, by index
// alone. Cycles are allowed: a link may be the child of several joints.
#include <vector>

namespace linkwise {

struct MachineGraph {
  struct Joint {
    int parent, child;  ///< links
    int freedom = 1;    ///< degrees of freedom
    /// Has a drive, spring, damper, friction, armature or limits: acts along its own coordinates.
    bool acts = false;
    bool weld = false;    ///< makes one piece of its two links
    bool closes = false;  ///< is a loop joint, whatever the links hang on
    bool stays = false;   ///< cannot close a loop: another joint has to
  };
  int ground = 0;              ///< the link that does not move; what hangs on it comes first
  std::vector<char> massless;  ///< by link: has neither mass nor inertia
  std::vector<Joint> joints;

  int n_links() const { return static_cast<int>(massless.size()); }
  int n_joints() const { return static_cast<int>(joints.size()); }
};

}  // namespace linkwise
