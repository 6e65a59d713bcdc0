#pragma once
/// What g++ has built in and clang has not, for the fuzzing build alone: read before every source of it (CMakePresets.json).

template <class Values, class Places>
inline Values __builtin_shuffle(Values a, Values b, Places places) noexcept {
  constexpr int lanes = sizeof(Values) / sizeof(a[0]);
  Values r = a;
  for (int i = 0; i < lanes; ++i) r[i] = places[i] < lanes ? a[places[i]] : b[places[i] - lanes];
  return r;
}
