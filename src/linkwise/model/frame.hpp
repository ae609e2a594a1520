#pragma once
// A point with axes on a link of the file, merged ones too: where wrenches act, and where motions
// and loads are asked for.
#include <string>

#include "linkwise/model/model.hpp"

namespace linkwise {

/// As the user states it: on which link, and how it is placed there.
struct Frame {
  std::string link;
  Transform<double> placement{Mat3<double>::identity(), {}};  ///< link frame -> frame
};

/// On what carries it.
struct FramePlacement {
  int joint = -1;  ///< whose child link moves it, -1: the ground
  /// The joint's user frame, or the world at the ground -> frame.
  Transform<double> placement{Mat3<double>::identity(), {}};
};

/// Throws InputError where the link is unknown, with the nearest names.
FramePlacement place_frame(const Model& model, const Frame& frame);

}  // namespace linkwise
