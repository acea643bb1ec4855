// What the page uses of three.js. esbuild leaves the rest out.
export {
  BufferAttribute,
  BufferGeometry,
  DataTexture,
  DoubleSide,
  GLSL3,
  LinearFilter,
  MOUSE,
  Mesh,
  NearestFilter,
  NoColorSpace,
  PerspectiveCamera,
  Points,
  RedIntegerFormat,
  Scene,
  ShaderMaterial,
  TOUCH,
  Texture,
  UnsignedShortType,
  Vector3,
  WebGLRenderer,
} from 'three';
export { OrbitControls } from 'three/addons/controls/OrbitControls.js';
