// 128-bit integers, for sums and products that must stay exact. A compiler extension of both compilers
// that Cairn supports; named here once so that pedantic warnings stay on everywhere else.
#pragma once

namespace cairn::formats {

__extension__ typedef __int128 Int128;
__extension__ typedef unsigned __int128 Uint128;

}  // namespace cairn::formats
