#include "good.cpp"   // sound, but compiled for another level of the processor: CMakeLists.txt
