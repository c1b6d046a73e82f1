#pragma once
#include <bit>
#include <cstdint>
#include <vector>

#include "engine/sampling/hash.h"
#include "engine/shading/lights/light_reach.h"

namespace penumbra::shading {

/// The lights of a scene by where they are, so that those which add nothing to a region, or hardly anything, need not
/// be looked at one after the other: bounds over more and more of them, as in Walter et al., "Lightcuts", SIGGRAPH
/// 2005. Immutable; may be shared between threads.
class LightTree {
 public:
  /// So few lights are looked at one after the other.
  static constexpr std::size_t most_without = 8;

  explicit LightTree(const std::vector<Light>& lights);

 private:
  friend class LightChoice;
  /// The lights from `begin` to `end` in order_. Of several, the one half is in the next node, the rest in `other`.
  struct Node {
    LightReach reach;
    std::uint32_t begin, end, other = 0;
    bool is_leaf() const { return end - begin == 1; }
    std::uint32_t count() const { return end - begin; }
  };
  std::uint32_t build(const std::vector<LightReach>& reaches, std::uint32_t begin, std::uint32_t end);
  std::vector<Node> nodes_;            // the root first, if any light has bounds
  std::vector<std::uint32_t> order_;   // lights, as nodes hold them
  std::vector<std::uint64_t> always_;  // a bit for each light that has no bounds
};

/// The lights to be looked at for a region. One per thread.
class LightChoice {
 public:
  /// All of so many.
  void take_all(std::size_t lights);
  /// Those of a tree that may light the region. With an `error` allowed only the brightest of them: of the rest some
  /// are drawn, at random by what they may add (Estevez, Kulla, "Importance Sampling of Many Lights with Adaptive Tree
  /// Splitting", 2018), that stand for all, and what they add up to is off by so much at most, root mean square, in any
  /// channel of any point.
  void take(const LightTree& tree, const LitRegion& region, double error, const sampling::Key& key);

  std::uint64_t culled() const { return culled_; }  // add nothing
  std::uint64_t unseen() const { return unseen_; }  // others stand for them
  /// Calls use(light) for each light that was taken, in the order of the scene, as long as it returns true.
  template <class Use>
  void for_each(const Use& use) const {
    for (std::size_t word = 0; word < taken_.size(); ++word) {
      for (std::uint64_t bits = taken_[word]; bits != 0; bits &= bits - 1) {
        if (!use(64 * word + static_cast<std::size_t>(std::countr_zero(bits)))) return;
      }
    }
  }
  /// So many times what it adds stands for others, and for itself. One for each of as many equal parts of what they
  /// may add, side by side; none or an even number.
  struct Drawn {
    std::uint32_t light;
    double times;
  };
  const std::vector<Drawn>& drawn() const { return drawn_; }

 private:
  /// A node whose lights may add so much.
  struct Open {
    double most;
    std::uint32_t node;
    bool operator<(const Open& other) const { return most < other.most; }
  };
  void take(const LightTree& tree, const LightTree::Node& node);
  /// Takes what may light the region, but for nodes that add `least` at most: they are open.
  void sort_out(const LightTree& tree, const LitRegion& region, double least);
  /// Opens the node if it adds something. Returns how much.
  double open(const LightTree& tree, const LitRegion& region, std::uint32_t node);
  /// Takes the brightest that are open until it costs less to draw. Returns how many are to be drawn.
  std::size_t take_brightest(const LightTree& tree, const LitRegion& region, double error);
  void draw(const LightTree& tree, const LitRegion& region, std::size_t count, const sampling::Key& key);
  /// Of an open node, `place` in [0, 1) of what its lights may add.
  Drawn drawn_below(const LightTree& tree, const LitRegion& region, const Open& open, double place) const;

  std::vector<std::uint64_t> taken_;  // a bit for each light
  std::size_t taken_count_ = 0;       // of those with bounds
  std::vector<std::uint32_t> pending_;
  std::vector<Open> open_;
  std::vector<Drawn> drawn_;
  std::uint64_t culled_ = 0, unseen_ = 0;
};

}  // namespace penumbra::shading
