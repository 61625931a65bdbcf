// What the page of `energymargin view` takes of three.js: make three
export { AmbientLight, BufferAttribute, BufferGeometry, CanvasTexture, CatmullRomCurve3, Color, ColorManagement, DirectionalLight, DoubleSide, GridHelper, Group, LineBasicMaterial, LineSegments, Mesh, MeshBasicMaterial, MeshLambertMaterial, PerspectiveCamera, Points, PointsMaterial, Scene, TubeGeometry, Vector3, WebGLRenderer } from "three";
export { OrbitControls } from "three/addons/controls/OrbitControls.js";
