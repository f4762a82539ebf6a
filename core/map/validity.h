// SPDX-License-Identifier: GPL-3.0-or-later
// Whether a map is a valid combinatorial map, asked dart by dart: what CGAL's is_valid() asks of the whole
// map in one go, as conditions on one dart and its neighbours, for any n and both storages.
#pragma once

#include <array>
#include <cstddef>
#include <string>
#include <vector>

#include "absl/strings/str_cat.h"

namespace ndmap {

// The darts next to d in its i-cell, free ones left out: closing under them gives the cell. Without kBack
// those that beta_0 leads to are left out, too: d is found from them.
template <unsigned i, bool kBack = true, class Lcc, class F>
void ForEachCellNeighbour(const Lcc& map, typename Lcc::Dart_const_handle d, F f) {
  constexpr unsigned n = Lcc::dimension;
  for (unsigned j = kBack ? 0 : 1; j <= n; ++j) {
    if constexpr (i == 0) {
      // Two steps: to a dart that ends at d's vertex, and from there to one that starts at it.
      if (j == 1 || map.is_free(d, j)) continue;
      const auto ending = map.beta(d, static_cast<int>(j));
      for (unsigned k = 1; k <= n; ++k) {
        if (k == j || (j == 0 && k == 1) || map.is_free(ending, k)) continue;
        f(map.beta(ending, static_cast<int>(k)));
      }
    } else {
      if (j == i || (i == 1 && j == 0) || map.is_free(d, j)) continue;
      f(map.beta(d, static_cast<int>(j)));
    }
  }
}

// Ask At() once for every dart, then AtEnd(). The map must not change meanwhile; marks and memory are held
// only during a call.
template <class Lcc>
class ValidityCheck {
 public:
  using Dart = typename Lcc::Dart_const_handle;
  static constexpr unsigned n = Lcc::dimension;

  explicit ValidityCheck(const Lcc& map) : map_(map) {}

  // What is wrong at a dart, as a sentence about it; empty if nothing is. O(1), and O(cell) for the one dart
  // of each cell that the cell's attribute names.
  std::string At(Dart d) {
    std::string fault = LinkFault(d);
    if (fault.empty()) Lcc::Helper::template Foreach_enabled_attributes<AttributesAt>::run(*this, d, fault);
    return fault;
  }

  // What only all darts together show: an attribute that two cells share.
  std::string AtEnd() const {
    for (unsigned i = 0; i <= n; ++i) {
      if (references_[i] == carriers_[i]) continue;
      return absl::StrCat(carriers_[i], " darts carry ", i, "-attributes, which count ", references_[i]);
    }
    return "";
  }

 private:
  struct AttributesAt {
    template <unsigned i>
    static void run(ValidityCheck& check, Dart d, std::string& fault) {
      if (fault.empty()) fault = check.template AttributeFault<i>(d);
    }
  };

  Dart Beta(Dart d, unsigned i) const { return map_.beta(d, static_cast<int>(i)); }
  static unsigned Inverse(unsigned i) { return i == 0 ? 1 : i == 1 ? 0 : i; }

  std::string LinkFault(Dart d) const {
    // Flat storage walks around the face for beta_0: once.
    const Dart before = Beta(d, 0);
    for (unsigned i = 0; i <= n; ++i) {
      const Dart e = i == 0 ? before : Beta(d, i);
      if (e == map_.null_dart_handle) continue;
      if (!map_.is_dart_used(e)) return absl::StrCat("beta ", i, " leads to a dart that was erased");
      if (i >= 2 && e == d) return absl::StrCat("beta ", i, " leads to the dart itself");
      // What was found by walking around the face is there: its darts follow each other.
      if (i < 2 && before != map_.null_dart_handle && FacesAreClosed()) continue;
      if (Beta(e, Inverse(i)) != d) {
        return i < 2 ? "beta 0 is not the inverse of beta 1" : absl::StrCat("beta ", i, " is no involution");
      }
    }
    // beta_i of beta_j is an involution for i + 2 <= j.
    for (unsigned i = 0; i + 2 <= n; ++i) {
      const Dart e = i == 0 ? before : Beta(d, i);
      if (e == map_.null_dart_handle) continue;
      for (unsigned j = i < 2 ? 3 : i + 2; j <= n; ++j) {
        if (map_.is_free(d, j) != map_.is_free(e, j) ||
            (!map_.is_free(d, j) && !SameEnd(Beta(d, j), Inverse(i), Beta(e, j)))) {
          return absl::StrCat("beta ", i, " and beta ", j, " do not fit");
        }
      }
    }
    return "";
  }

  // Whether beta_i of d is there and is e; beta_0 asked the other way round, which is as good: each is found
  // to be the other's inverse.
  bool SameEnd(Dart d, unsigned i, Dart e) const {
    if (!map_.is_dart_used(d)) return false;
    return i == 0 ? map_.is_dart_used(e) && Beta(e, 1) == d : !map_.is_free(d, i) && Beta(d, i) == e;
  }

  // Whether every beta_0 is found by walking, in a storage that does so.
  bool FacesAreClosed() const {
    if constexpr (requires { map_.darts().exceptions(); }) {
      return map_.darts().exceptions() == 0;
    } else {
      return false;
    }
  }

  template <unsigned i>
  std::string AttributeFault(Dart d) {
    const auto a = map_.template attribute<i>(d);
    bool equal = true;
    ForEachCellNeighbour<i, false>(map_, d, [&](Dart e) {
      equal = equal && map_.is_dart_used(e) && map_.template attribute<i>(e) == a;
    });
    if (!equal) return absl::StrCat("its ", i, "-cell has several ", i, "-attributes");
    if (a == Lcc::null_handle) return i == 0 ? "it has no vertex" : "";
    ++carriers_[i];
    const Dart named = map_.template dart_of_attribute<i>(a);
    if (named == Lcc::null_handle || !map_.is_dart_used(named) || map_.template attribute<i>(named) != a) {
      return absl::StrCat("its ", i, "-attribute names a dart of another cell, or none");
    }
    if (named != d) return "";
    const size_t references = map_.template get_attribute_ref_counting<i>(a);
    references_[i] += references;
    const size_t darts = CellSize<i>(d);
    if (darts == references) return "";
    return absl::StrCat("its ", i, "-attribute counts ", references, " darts, and its ", i, "-cell has ",
                        darts);
  }

  template <unsigned i>
  size_t CellSize(Dart d) {
    const auto mark = map_.get_new_mark();
    cell_.clear();
    const auto visit = [&](Dart e) {
      if (!map_.is_dart_used(e) || map_.is_marked(e, mark)) return;
      map_.mark(e, mark);
      cell_.push_back(e);
    };
    visit(d);
    for (size_t k = 0; k < cell_.size(); ++k) ForEachCellNeighbour<i>(map_, Dart(cell_[k]), visit);
    for (Dart e : cell_) map_.unmark(e, mark);
    map_.free_mark(mark);
    return cell_.size();
  }

  const Lcc& map_;
  std::vector<Dart> cell_;
  // By dimension: darts that have an attribute, and how many the attributes say there are.
  std::array<size_t, n + 1> carriers_{};
  std::array<size_t, n + 1> references_{};
};

}  // namespace ndmap
