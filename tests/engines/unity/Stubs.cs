// Stubs of the Unity API that the package calls, which record instead of draw. Signatures of Unity 2022.3.
using System;
using System.Collections.Generic;
using System.Linq;
using System.Web.Script.Serialization;
using UnityEngine;

namespace UnityEngine
{
    public struct Vector2
    {
        public float x, y;
        public Vector2(float x, float y) { this.x = x; this.y = y; }
    }

    public struct Vector3
    {
        public float x, y, z;
        public Vector3(float x, float y, float z) { this.x = x; this.y = y; this.z = z; }
        public static Vector3 operator -(Vector3 v) { return new Vector3(-v.x, -v.y, -v.z); }
        public static Vector3 Cross(Vector3 a, Vector3 b)
        {
            return new Vector3(a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x);
        }
    }

    public struct Vector4
    {
        public float x, y, z, w;
        public Vector4(float x, float y) : this(x, y, 0, 0) { }
        public Vector4(float x, float y, float z, float w) { this.x = x; this.y = y; this.z = z; this.w = w; }
        public float this[int i]
        {
            get { return new[] { x, y, z, w }[i]; }
            set
            {
                if (i == 0) x = value;
                else if (i == 1) y = value;
                else if (i == 2) z = value;
                else if (i == 3) w = value;
                else throw new IndexOutOfRangeException();
            }
        }
    }

    public static class Mathf
    {
        public static float Sqrt(float value) { return (float)Math.Sqrt(value); }
        public static float Min(float a, float b) { return Math.Min(a, b); }
    }

    public static class JsonUtility
    {
        public static T FromJson<T>(string json)
        {
            try
            {
                return new JavaScriptSerializer { MaxJsonLength = int.MaxValue }.Deserialize<T>(json);
            }
            catch (InvalidOperationException error)
            {
                throw new ArgumentException(error.Message);  // as Unity's own does
            }
        }
    }

    public class Object
    {
        public string name;
    }

    public class Texture : Object { }
    public class Texture2D : Texture { public string path; }

    public class Shader : Object
    {
        public static HashSet<string> Known = new HashSet<string>();
        public static Shader Find(string name) { return Known.Contains(name) ? new Shader { name = name } : null; }
    }

    public class Material : Object
    {
        public readonly Dictionary<string, object> Values = new Dictionary<string, object>();
        public readonly Shader shader;
        public int renderQueue;
        public Material(Shader shader) { this.shader = shader; }
        public void SetFloat(string name, float value) { Values[name] = value; }
        public void SetVector(string name, Vector4 v) { Values[name] = new[] { v.x, v.y, v.z, v.w }; }
        public void SetTexture(string name, Texture texture) { Values[name] = ((Texture2D)texture)?.path; }
        public void SetShaderPassEnabled(string name, bool isOn) { Values[name] = isOn; }
    }

    public class Mesh : Object
    {
        public readonly Dictionary<int, int[]> Parts = new Dictionary<int, int[]>();
        public Rendering.IndexFormat indexFormat;
        public Vector3[] vertices, normals;
        public Vector4[] tangents;
        public Vector2[] uv, uv2;
        public int subMeshCount;
        public void SetTriangles(int[] triangles, int part)
        {
            if (part >= subMeshCount || triangles.Any(i => i >= vertices.Length)) throw new ArgumentException();
            Parts[part] = triangles;
        }
        public void RecalculateBounds() { }
    }

    public class Component : Object { }

    public class Transform : Component
    {
        public Transform parent;
        public void SetParent(Transform parent, bool worldPositionStays) { this.parent = parent; }
    }

    public class GameObject : Object
    {
        public readonly Transform transform = new Transform();
        public readonly List<Component> components = new List<Component>();
        public GameObject(string name) { this.name = name; }
        public T AddComponent<T>() where T : Component, new()
        {
            var component = new T();
            components.Add(component);
            return component;
        }
    }

    public class MeshFilter : Component { public Mesh sharedMesh; }
    public class Renderer : Component { public Material[] sharedMaterials; }
    public class MeshRenderer : Renderer { }

    public struct LOD
    {
        public float screenRelativeTransitionHeight;
        public Renderer[] renderers;
        public float fadeTransitionWidth;
        public LOD(float height, Renderer[] renderers)
        {
            fadeTransitionWidth = 0;
            screenRelativeTransitionHeight = height;
            this.renderers = renderers;
        }
    }

    public enum LODFadeMode { None, CrossFade, SpeedTree }

    public sealed class RangeAttribute : Attribute
    {
        public RangeAttribute(float min, float max) { }
    }

    public sealed class TooltipAttribute : Attribute
    {
        public TooltipAttribute(string tooltip) { }
    }

    public class LODGroup : Component
    {
        public LOD[] lods;
        public LODFadeMode fadeMode;
        public void SetLODs(LOD[] lods)
        {
            // Unity logs this and keeps its former levels
            for (var i = 1; i < lods.Length; i++)
                if (lods[i].screenRelativeTransitionHeight >= lods[i - 1].screenRelativeTransitionHeight)
                    throw new InvalidOperationException(
                        "SetLODs: Attempting to set LOD where the screen relative size is greater then or equal "
                        + "to a higher detail LOD level.");
            this.lods = lods;
        }
        public void RecalculateBounds() { }
    }

    public enum TextureWrapMode { Repeat, Clamp }
}

namespace UnityEngine.Rendering
{
    public enum IndexFormat { UInt16, UInt32 }
    public enum CullMode { Off, Front, Back }
    public enum BlendMode { Zero = 0, One = 1, SrcAlpha = 5, OneMinusSrcAlpha = 10 }
    public class RenderPipelineAsset : Object { }
    public class HDRenderPipelineAsset : RenderPipelineAsset { }

    public static class GraphicsSettings
    {
        public static RenderPipelineAsset currentRenderPipeline;
    }
}

namespace UnityEditor
{
    public class AssetImporter : UnityEngine.Object
    {
        public static readonly Dictionary<string, AssetImporter> Known = new Dictionary<string, AssetImporter>();
        public static readonly List<string> Reimported = new List<string>();
        public string assetPath;
        public static AssetImporter GetAtPath(string path)
        {
            return Known.TryGetValue(path, out var importer) ? importer : null;
        }
        public void SaveAndReimport() { Reimported.Add(assetPath); }
    }

    public class AssetPostprocessor
    {
        public string assetPath;
        public AssetImporter assetImporter;
    }

    public enum TextureImporterNPOTScale { None, ToNearest }
    public enum TextureImporterFormat { Automatic = -1, RGBAFloat = 20 }

    public class TextureImporterPlatformSettings
    {
        public TextureImporterFormat format = TextureImporterFormat.Automatic;
    }

    public class TextureImporter : AssetImporter
    {
        public bool sRGBTexture = true, mipmapEnabled = true, alphaIsTransparency;
        public int maxTextureSize = 2048;
        public TextureImporterNPOTScale npotScale = TextureImporterNPOTScale.ToNearest;
        public TextureWrapMode wrapMode;
        public TextureImporterPlatformSettings platform = new TextureImporterPlatformSettings();
        public TextureImporterPlatformSettings GetDefaultPlatformTextureSettings() { return platform; }
        public void SetPlatformTextureSettings(TextureImporterPlatformSettings settings) { platform = settings; }
    }

    public static class AssetDatabase
    {
        public static readonly Dictionary<string, Type> Overrides = new Dictionary<string, Type>();
        public static T LoadAssetAtPath<T>(string path) where T : Texture2D, new()
        {
            return System.IO.File.Exists(path) ? new T { path = System.IO.Path.GetFileName(path) } : null;
        }
        public static Type GetImporterOverride(string path)
        {
            return Overrides.TryGetValue(path, out var type) ? type : null;
        }
        public static void SetImporterOverride<T>(string path) where T : AssetImporters.ScriptedImporter
        {
            Overrides[path] = typeof(T);
        }
    }
}

namespace UnityEditor.AssetImporters
{
    public class ScriptedImporterAttribute : Attribute
    {
        public ScriptedImporterAttribute(int version, string[] extensions, string[] overridden) { }
    }

    public abstract class ScriptedImporter : AssetImporter
    {
        public abstract void OnImportAsset(AssetImportContext context);
    }

    public class AssetImportContext
    {
        public readonly List<UnityEngine.Object> Assets = new List<UnityEngine.Object>();
        public readonly List<string> Errors = new List<string>(), Warnings = new List<string>();
        public readonly List<string> Sources = new List<string>(), Artifacts = new List<string>();
        public string assetPath;
        public UnityEngine.Object Main;
        public void AddObjectToAsset(string identifier, UnityEngine.Object asset) { Assets.Add(asset); }
        public void SetMainObject(UnityEngine.Object asset) { Main = asset; }
        public void DependsOnSourceAsset(string path) { Sources.Add(path); }
        public void DependsOnArtifact(string path) { Artifacts.Add(path); }
        public void LogImportError(string text) { Errors.Add(text); }
        public void LogImportWarning(string text) { Warnings.Add(text); }
    }
}
