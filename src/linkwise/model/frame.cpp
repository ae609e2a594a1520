#include "linkwise/model/frame.hpp"

namespace linkwise {

FramePlacement place_frame(const Model& model, const Frame& frame) {
  const LinkInfo& link = model.links[model.link_index(frame.link)];
  return {link.joint, frame.placement * link.placement};
}

}  // namespace linkwise
