#include "warp/gltf_animation.h"

namespace surflect::warp {

namespace {

// Returns for each node whether its motion moves the skin: joints and their ancestors.
std::vector<uint8_t> movesSkin(const Skeleton& skeleton) {
  std::vector<uint8_t> moves(skeleton.nodes.size(), 0);
  for (const SkinJoint& joint : skeleton.joints) moves[joint.node] = 1;
  for (size_t k = skeleton.order.size(); k-- > 0;)
    if (const uint32_t i = skeleton.order[k]; moves[i] && skeleton.nodes[i].parent)
      moves[*skeleton.nodes[i].parent] = 1;
  return moves;
}

// Effect of an animation channel on the skin; empty if it has none.
std::optional<Channel> readChannel(GltfDocument& document, const GltfField& field,
                                   const std::vector<GltfField>& samplers, const Skeleton& skeleton,
                                   const std::vector<GltfField>& nodes, const std::vector<uint8_t>& moves) {
  Channel channel;
  const GltfField target = field.require("target"), path = target.require("path");
  const auto node = target.find("node");
  if (!node) return std::nullopt; // defined by an extension
  channel.node = static_cast<uint32_t>(node->index(skeleton.nodes.size()));
  if (path.text() == "weights") {
    if (nodes[channel.node].find("skin"))
      path.refuse("none that morphs the skin: morph targets are not read");
    return std::nullopt;
  }
  if (!moves[channel.node]) return std::nullopt;
  if (skeleton.nodes[channel.node].fixed) node->refuse("a node without a matrix");
  if (path.text() == "translation")
    channel.property = Channel::Property::translation;
  else if (path.text() == "rotation")
    channel.property = Channel::Property::rotation;
  else if (path.text() == "scale")
    channel.property = Channel::Property::scale;
  else
    path.refuse("translation, rotation or scale");

  const GltfField sampler = samplers[field.require("sampler").index(samplers.size())];
  const auto interpolation = sampler.find("interpolation");
  const std::string name = interpolation ? interpolation->text() : "LINEAR";
  if (name == "STEP")
    channel.interpolation = Interpolation::step;
  else if (name == "LINEAR")
    channel.interpolation = Interpolation::linear;
  else if (name == "CUBICSPLINE")
    channel.interpolation = Interpolation::cubicSpline;
  else
    interpolation->refuse("LINEAR, STEP or CUBICSPLINE");

  const GltfField input = sampler.require("input"), output = sampler.require("output");
  channel.seconds = document.read(input, "SCALAR", 1, GltfNumbers::floats);
  for (size_t i = 1; i < channel.seconds.size(); ++i)
    if (!(channel.seconds[i] > channel.seconds[i - 1])) input.refuse("times that increase");
  const bool turns = channel.property == Channel::Property::rotation;
  const size_t width = turns ? 4 : 3;
  channel.values = document.read(output, turns ? "VEC4" : "VEC3", width,
                                 turns ? GltfNumbers::floatsOrNormalized : GltfNumbers::floats);
  const size_t perKey = channel.interpolation == Interpolation::cubicSpline ? 3 * width : width;
  if (channel.values.size() != perKey * channel.seconds.size())
    output.refuse("values for " + std::to_string(channel.seconds.size()) + " keys");
  if (turns)
    for (size_t i = perKey == width ? 0 : width; i < channel.values.size(); i += perKey) {
      Eigen::Map<Eigen::Vector4d> key(&channel.values[i]);
      if (!(key.norm() > 1e-6)) output.refuse("rotations");
      key.normalize();
    }
  return channel;
}

} // namespace

std::vector<GltfAnimation> readAnimations(GltfDocument& document, const Skeleton& skeleton) {
  std::vector<GltfAnimation> animations;
  const std::vector<GltfField> nodes = document.root().elementsOf("nodes");
  const std::vector<uint8_t> moves = movesSkin(skeleton);
  for (const GltfField& field : document.root().elementsOf("animations")) {
    GltfAnimation& animation = animations.emplace_back();
    try {
      if (const auto name = field.find("name")) animation.name = name->text();
      const std::vector<GltfField> samplers = field.require("samplers").elements();
      for (const GltfField& channel : field.require("channels").elements())
        if (auto read = readChannel(document, channel, samplers, skeleton, nodes, moves))
          animation.channels.push_back(std::move(*read));
    } catch (Error& error) {
      animation.channels.clear();
      animation.refusal = std::move(error);
    }
  }
  return animations;
}

} // namespace surflect::warp
